"""The documentation builds without a warning and omits nothing; the documents mention only what exists."""

import importlib
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest
from click.testing import CliRunner

from .tolerances import PATIENCE_S

CHECKOUT = Path(__file__).resolve().parents[1]
PAGES = sorted(path.relative_to(CHECKOUT).as_posix() for path in (CHECKOUT / "docs").glob("*.md"))
DOCUMENTS = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", *PAGES)


@pytest.fixture
def docs(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(CHECKOUT)
    return importlib.import_module("scripts.manual.reference")


def test_reference_contains_every_public_name(docs: ModuleType, tmp_path: Path) -> None:
    docs.build(tmp_path)
    for name in docs.MODULES:
        module = importlib.import_module(name)
        page = (tmp_path / f"{name.replace('.', '/')}.html").read_text()
        anchors = set(re.findall(r'id="([\w.]+)"', page))
        # a module has its own page
        own = {each for each in module.__all__ if not isinstance(getattr(module, each), ModuleType)}
        assert own - {"__version__"} <= anchors
    assert "Renderer.render" in (tmp_path / "glshadow.html").read_text()


WORDLESS = """
class A:
    "Says something."
    field: int = 1
    def method(self): pass
    @property
    def value(self): return 1
    def _hidden(self): pass
def function(): pass
def told(): "Says something."
"""
MISTYPED = """
from __future__ import annotations
def told(number: NoSuchType): "Says something."
"""


@pytest.mark.parametrize(
    ("source", "says"),
    [
        (WORDLESS, r"without a docstring: sample\.A\.method, sample\.A\.value, sample\.function$"),
        (MISTYPED, "NoSuchType"),
    ],
    ids=["no docstring", "warning"],
)
def test_faulty_docstring_fails_the_build(
    docs: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, source: str, says: str
) -> None:
    (tmp_path / "sample.py").write_text(source)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "sample", raising=False)
    monkeypatch.setattr(docs, "MODULES", ("sample",))
    with pytest.raises((ValueError, UserWarning), match=says):
        docs.build(tmp_path / "pages")


@pytest.mark.parametrize("name", DOCUMENTS)
def test_paths_in_the_documents_exist(name: str) -> None:
    text = (CHECKOUT / name).read_text()
    roots = r"\.ci|scripts|tests|examples|docs|glshadow|glsl"
    paths = {path for path in re.findall(rf"(?<![\w/.])(?:{roots})/[\w./]*\w", text) if "NEW" not in path}
    assert sorted(path for path in paths if not (CHECKOUT / path).exists()) == []


@pytest.mark.parametrize("name", DOCUMENTS)
def test_links_in_the_documents_resolve(name: str) -> None:
    page = CHECKOUT / name
    for target in re.findall(r"\]\((?!https?:)([^)]+)\)", page.read_text()):
        path, _, anchor = target.partition("#")
        linked = (page.parent / path).resolve() if path else page
        assert linked.exists(), target
        if anchor:
            heads = re.findall(r"^#+ (.+)", linked.read_text(), re.MULTILINE)
            assert anchor in {re.sub(r"[^\w -]", "", head).lower().replace(" ", "-") for head in heads}, target


def test_every_page_is_listed() -> None:
    listed = re.findall(r"^\| \[[^]]+\]\(([\w./]+)\)", (CHECKOUT / "docs" / "README.md").read_text(), re.MULTILINE)
    assert {f"docs/{name}" for name in listed if "/" not in name} == set(PAGES) - {"docs/README.md"}


@pytest.mark.slow
@pytest.mark.exhaustive
def test_documentation_builds(tmp_path: Path) -> None:
    """By the command itself, with one example; all examples, guides and notebooks run in tests of their own."""
    command = [CHECKOUT / "scripts" / "docs", tmp_path / "site", "--only", "01_first_picture"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 0, done.stderr
    site = tmp_path / "site"
    pages = sorted(site.rglob("*.html"))
    for page in pages:
        for target in re.findall(r'(?:href|src)="(?!\w+:|//|\$)([^"#?]+)', page.read_text()):
            assert (page.parent / target).exists(), f"{page.relative_to(site)} leads to {target}"
    names = {page.relative_to(site).as_posix() for page in pages}
    assert {Path(name).with_suffix(".html").as_posix() for name in PAGES} <= names
    assert "gallery/01_first_picture.html" in names
    assert "reference/glshadow.html" in names
    shown = (site / "gallery" / "01_first_picture.html").read_text()
    assert re.search(r'<img[^>]+src="[^"]*01_first_picture\.png"', shown)
    assert "_small.jpg" in (site / "gallery" / "index.html").read_text()


def test_page_contains_the_images_of_its_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(CHECKOUT)
    build = importlib.import_module("scripts.manual.build")
    page = tmp_path / "docs" / "page.md"
    page.parent.mkdir()
    page.write_text(
        "# A page\n\n```sh\nprintf picture > a.png\n```\n\n<!-- shows: a.png -->\n\n`examples/05_bias.py`, `examples/06_x.py`\n"
    )
    build._run_page(page, tmp_path / "stage")
    build._stage(page, tmp_path / "stage" / "page.md", {"05_bias"})
    assert (tmp_path / "stage" / "page_a.png").read_text() == "picture"
    text = (tmp_path / "stage" / "page.md").read_text()
    assert "![a.png](page_a.png)" in text
    assert "[`examples/05_bias.py`](../gallery/05_bias.md), `examples/06_x.py`" in text


def test_folder_with_other_content_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(CHECKOUT)
    build = importlib.import_module("scripts.manual.build")
    (tmp_path / "thesis.tex").write_text("years")
    done = CliRunner().invoke(build.main, [str(tmp_path)])
    assert done.exit_code == 1
    assert "contains other files than these pages" in done.output
    assert (tmp_path / "thesis.tex").read_text() == "years"
    done = CliRunner().invoke(build.main, [str(tmp_path / "new"), "--only", "nothing"])
    assert done.exit_code == 2
    assert "there is no nothing; there are 01_first_picture" in done.output


def test_build_errors_name_their_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(CHECKOUT)
    build, gallery = (importlib.import_module(f"scripts.manual.{name}") for name in ("build", "gallery"))
    broken = tmp_path / "99_broken.py"
    broken.write_text('"""Breaks. Look at: nothing."""\nraise ValueError("on purpose")\n')
    with pytest.raises(RuntimeError, match=r"99_broken\.py: (.|\n)*on purpose"):
        gallery.run_example(broken, tmp_path / "made")
    page = tmp_path / "page.md"
    page.write_text("# A page\n\n```sh\nfalse\n```\n")
    with pytest.raises(RuntimeError, match=r"page\.md, line 3: exit code 1"):
        build._run_page(page, tmp_path / "pages")
