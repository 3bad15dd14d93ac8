"""Words of our own for which the field has better ones: where they stand, and what to write instead.

The words are in pyproject.toml, `[tool.glshadow.words]`. Only prose is read: Markdown without code and link targets, comments and
docstrings of Python, text and comments of notebooks, comments of GLSL.
"""

from __future__ import annotations

import ast
import io
import json
import re
import tokenize
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

ROOT = Path(__file__).resolve().parents[1]
Lines = Iterator[tuple[int, str]]

_FENCE = re.compile(r"^\s*(```|~~~)")
_CODE = re.compile(r"`[^`]*`|\]\([^)]*\)|<!--.*?-->|<[^>]+>|https?://\S+")
_GLSL = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)


@dataclass(frozen=True)
class Words:
    """The table.

    Parameters
    ----------
    files : tuple of str
        Globs of what is read.
    instead : mapping from regular expression to str
        A word or phrase, as a whole and in any case -> what to write.
    allowed : tuple of str
        Regular expressions of contexts in which a word is meant as English has it.
    """

    files: tuple[str, ...]
    instead: dict[str, str]
    allowed: tuple[str, ...]

    @classmethod
    def of(cls, project: dict[str, Any]) -> Words:
        """Of a parsed pyproject.toml."""
        table = project["tool"]["glshadow"]["words"]
        return cls(tuple(table["files"]), dict(table["instead"]), tuple(table["allowed"]))

    def hits(self, line: str) -> list[tuple[str, str]]:
        """Each word of a line that has a better one, and that one."""
        meant = [found.span() for context in self.allowed for found in re.finditer(context, line, re.IGNORECASE)]
        return [
            (found[0], better)
            for word, better in self.instead.items()
            for found in re.finditer(rf"\b(?:{word})\b", line, re.IGNORECASE)
            if not any(start <= found.start() and found.end() <= end for start, end in meant)
        ]


def prose(path: Path) -> Lines:
    """Lines of a file that are meant to be read, without code, and their numbers."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".md":
        yield from _markdown(_top_section(text) if path.name == "CHANGELOG.md" else text)
    elif path.suffix == ".py":
        yield from _python(text)
    elif path.suffix == ".ipynb":
        yield from _notebook(text)
    else:
        for found in _GLSL.finditer(text):
            yield from enumerate(found[0].splitlines(), start=text.count("\n", 0, found.start()) + 1)


def _top_section(text: str) -> str:
    """Up to the second version: what was released keeps its words."""
    heads = [found.start() for found in re.finditer(r"^## ", text, re.MULTILINE)]
    return text[: heads[1]] if len(heads) > 1 else text


def _markdown(text: str) -> Lines:
    fenced = False
    for number, line in enumerate(text.splitlines(), start=1):
        if _FENCE.match(line):
            fenced = not fenced
        elif not fenced:
            yield number, _CODE.sub(" ", line)


def _python(text: str) -> Lines:
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], _CODE.sub(" ", token.string)
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and (
            words := ast.get_docstring(node, clean=False)
        ):
            for number, line in enumerate(words.splitlines(), start=node.body[0].lineno):
                yield number, _CODE.sub(" ", line)


def _notebook(text: str) -> Lines:
    """Numbered by cell: a notebook has no lines to speak of."""
    for number, cell in enumerate(json.loads(text)["cells"], start=1):
        source = "".join(cell["source"])
        for _, line in _markdown(source) if cell["cell_type"] == "markdown" else _python(source):
            yield number, line


def found_in(root: Path, words: Words) -> list[str]:
    """`file:line: word: write this instead` for every hit below a folder."""
    paths = sorted({path for pattern in words.files for path in root.glob(pattern)})
    return [
        f"{path.relative_to(root)}:{number}: {word!r}: write {better}"
        for path in paths
        for number, line in prose(path)
        for word, better in words.hits(line)
    ]


@click.command(help=__doc__)
@click.option("--files", multiple=True, help="Globs to read instead of those of the table.")
def main(files: tuple[str, ...]) -> None:
    words = Words.of(tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8")))
    found = found_in(ROOT, Words(files or words.files, words.instead, words.allowed))
    if found:
        raise click.ClickException("\n" + "\n".join(found))


if __name__ == "__main__":
    main()
