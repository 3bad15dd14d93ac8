"""The checker of words finds what the table names, in prose alone, and leaves what is meant as English has it."""

from __future__ import annotations

import importlib
import json
import tomllib
from pathlib import Path
from types import ModuleType

import pytest
from click.testing import CliRunner

CHECKOUT = Path(__file__).resolve().parents[1]
TABLE = {
    "files": ["*.md", "*.py", "*.ipynb", "*.glsl"],
    "instead": {"asks?": "samples", "rooms?": "packages"},
    "allowed": [r"\basks? for\b", "a room of"],
}


@pytest.fixture
def words(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(CHECKOUT)
    return importlib.import_module("scripts.words")


def found(words: ModuleType, folder: Path, **files: str) -> list[str]:
    for name, text in files.items():
        (folder / name.replace("_", ".")).write_text(text)
    return words.found_in(folder, words.Words.of({"tool": {"glshadow": {"words": TABLE}}}))


@pytest.mark.parametrize(
    ("line", "hit"),
    [
        ("Each pixel asks the map.", True),
        ("ASK the map", True),
        ("Ask for shadows.", False),
        ("who asks for it asks twice", True),
        ("a room of columns, in three rooms", True),
        ("a room of columns", False),
        ("tasks and asked", False),
        ("`gs.ask(room)`", False),
        ("[a page](room.md) at https://ask.com", False),
        ("<!-- table: rooms -->", False),
    ],
)
def test_a_hit_is_found_and_an_exception_is_not(words: ModuleType, tmp_path: Path, line: str, hit: bool) -> None:
    assert len(found(words, tmp_path, page_md=f"# Title\n\n{line}\n")) == hit


def test_file_and_line_are_named(words: ModuleType, tmp_path: Path) -> None:
    page = "text\n\n```python\nrooms = 3  # asks\n```\n\nThe room asks.\n"
    assert found(words, tmp_path, page_md=page) == [
        "page.md:7: 'asks': write samples",
        "page.md:7: 'room': write packages",
    ]


def test_only_words_of_code_are_read(words: ModuleType, tmp_path: Path) -> None:
    code = '"""It asks.\n\nTwo rooms."""\n\nroom = "ask"  # a room\n\n\ndef ask() -> None:\n    "A room."\n'
    notebook = {
        "cells": [{"cell_type": "markdown", "source": ["no"]}, {"cell_type": "code", "source": ["# asks\n", "ask = 1"]}]
    }
    hits = found(
        words,
        tmp_path,
        code_py=code,
        book_ipynb=json.dumps(notebook),
        snippet_glsl="float ask; // a room\n/* it\nasks */",
    )
    assert sorted(hits) == [
        "book.ipynb:2: 'asks': write samples",
        "code.py:1: 'asks': write samples",
        "code.py:3: 'rooms': write packages",
        "code.py:5: 'room': write packages",
        "code.py:9: 'room': write packages",
        "snippet.glsl:1: 'room': write packages",
        "snippet.glsl:3: 'asks': write samples",
    ]


def test_only_the_top_section_of_the_changes_is_read(words: ModuleType, tmp_path: Path) -> None:
    (tmp_path / "CHANGELOG.md").write_text("# Changes\n\n## [2]\n\nIt asks.\n\n## [1]\n\nIt asks.\n")
    assert found(words, tmp_path) == ["CHANGELOG.md:5: 'asks': write samples"]


def test_the_command_fails_and_says_where(words: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "pyproject.toml").write_text((CHECKOUT / "pyproject.toml").read_text())
    (tmp_path / "README.md").write_text("Every pixel asks a map of means.\n")
    monkeypatch.setattr(words, "ROOT", tmp_path)
    done = CliRunner().invoke(words.main, [])
    assert done.exit_code == 1
    assert "README.md:1: 'asks': write samples" in done.stderr
    assert "README.md:1: 'map of means': write prefiltered (moment) shadow map" in done.stderr
    assert CliRunner().invoke(words.main, ["--files", "*.toml.md"]).exit_code == 0


def test_the_documents_hold_none(words: ModuleType) -> None:
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text())
    assert words.found_in(CHECKOUT, words.Words.of(project)) == []
