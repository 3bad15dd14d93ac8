"""Builds the documentation as HTML: README, pages with the images that their code makes, gallery, notebooks, API reference.

Sphinx warnings are errors: broken links, pages in no table of contents.
"""

from __future__ import annotations

import io
import re
import shutil
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import click
from sphinx.application import Sphinx

import glshadow
from scripts.manual import gallery, reference, sessions

ROOT = Path(__file__).resolve().parents[2]
GUIDES = ("tutorial", "arrays", "cameras", "notebooks", "window", "programs", "pyrender", "page", "batch")
"""Pages for one who begins, in their order."""
INVENTORY = "objects.inv"
"""Files that Sphinx leaves in its output folder: a folder without them is not overwritten."""
_SHOWS = re.compile(r"^<!-- shows: (\S+) -->$", re.MULTILINE)
_EXAMPLE = re.compile(r"`examples/(\w+)\.py`")
STYLE = """
.cards { display: grid; grid-template-columns: repeat(auto-fill, minmax(15rem, 1fr)); gap: 1.2rem; }
.cards .card { border: 1px solid var(--color-background-border); border-radius: .4rem; padding: .6rem; font-size: .85rem; }
.cards .card p { margin: 0 0 .4rem; }
.cards .card img { width: 100%; height: 9rem; object-fit: contain; background: var(--color-background-secondary); }
.cards .card pre { height: 9rem; overflow: hidden; font-size: .6rem; }
.content { width: 56em; }
table.docutils { display: block; overflow-x: auto; max-width: 100%; }
"""
SETTINGS = {
    "project": "glshadow",
    "copyright": "glshadow developers",
    "version": glshadow.__version__,
    "release": glshadow.__version__,
    "extensions": ["myst_nb"],
    "html_theme": "furo",
    "html_title": f"glshadow {glshadow.__version__}",
    "html_static_path": ["_static"],
    "html_css_files": ["manual.css"],
    "html_copy_source": False,
    "html_show_sphinx": False,
    "myst_enable_extensions": ["colon_fence"],
    "myst_heading_anchors": 3,
    "nb_execution_mode": "force",
    "nb_execution_timeout": 300,
    "nb_execution_raise_on_error": True,
    "nb_execution_in_temp": True,
    "nb_merge_streams": True,
    "suppress_warnings": ["mystnb.unknown_mime_type", "misc.highlighting_failure"],
}


def build(folder: Path, only: Sequence[str] = (), said: Callable[[str], None] = lambda _: None) -> None:
    """Build the pages.

    Parameters
    ----------
    folder : Path
        Output folder; an earlier build in it is replaced.
    only : sequence of str
        Names of the guides, examples and notebooks to run; None runs all. The others become pages without images, or are left out.
    said : callable
        Called with progress messages.

    Raises
    ------
    RuntimeError, ValueError
        If an example, a page or a notebook fails; if a public name has no docstring; if Sphinx warns, with all its warnings; if the folder
        contains anything else.
    """
    if folder.exists() and any(folder.iterdir()) and not (folder / INVENTORY).is_file():
        raise ValueError(f"{folder} contains other files than these pages: name an empty or new folder")
    wanted = (lambda name: name in only) if only else lambda _: True
    with tempfile.TemporaryDirectory() as temporary:
        stage, made = Path(temporary) / "pages", Path(temporary) / "made"
        examples = [path for path in sorted((ROOT / "examples").glob("[0-9]*.py")) if wanted(path.stem)]
        shown = []
        for path in examples:
            said(path.name)
            shown.append(gallery.run_example(path, made / path.stem))
        gallery.write_gallery(shown, stage / "gallery")
        notebooks = [path for path in sorted((ROOT / "examples").glob("*.ipynb")) if wanted(path.stem)]
        (stage / "examples").mkdir()
        for path in notebooks:
            shutil.copy(path, stage / "examples")
        shutil.copytree(ROOT / "examples" / "pictures", stage / "examples" / "pictures")
        names = {path.stem for path in examples + notebooks}
        for name in GUIDES:
            if wanted(name):
                said(f"docs/{name}.md")
                _run_page(ROOT / "docs" / f"{name}.md", stage / "docs")
        for path in sorted((ROOT / "docs").glob("*.md")):
            _stage(path, stage / "docs" / path.name, names)
        for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md"):
            _stage(ROOT / name, stage / name, names)
        (stage / "index.md").write_text(_index(stage / "README.md", [path.stem for path in notebooks]))
        (stage / "README.md").unlink()
        (stage / "reference.md").write_text(_reference())
        said("API reference")
        reference.build(Path(temporary) / "extra" / "reference")
        (stage / "_static").mkdir()
        (stage / "_static" / "manual.css").write_text(STYLE)
        said("Sphinx")
        settings = {**SETTINGS, "html_extra_path": [str(Path(temporary) / "extra")]}
        if folder.exists():
            shutil.rmtree(folder)
        heard = io.StringIO()
        Sphinx(stage, None, folder, Path(temporary) / "trees", "html", settings, status=None, warning=heard).build()
        if heard.getvalue():
            raise RuntimeError(heard.getvalue().replace(str(stage), ""))


def _run_page(page: Path, folder: Path) -> None:
    """Run a page's blocks and copy the images that it shows."""
    text = page.read_text()
    folder.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as place:
        for block in sessions.blocks_of(text):
            try:
                sessions.run(block, Path(place))
            except RuntimeError as error:
                raise RuntimeError(f"{page.name}, {error}") from None
        for name in _SHOWS.findall(text):
            shutil.copy(Path(place) / name, folder / f"{page.stem}_{Path(name).name}")


def _stage(page: Path, target: Path, names: set[str]) -> None:
    """A page prepared for Sphinx, with its images and links."""
    target.parent.mkdir(exist_ok=True)
    up = "" if page.parent == ROOT else "../"

    def picture(found: re.Match[str]) -> str:
        name = f"{page.stem}_{Path(found[1]).name}"
        return f"![{found[1]}]({name})" if (target.parent / name).exists() else ""

    def example(found: re.Match[str]) -> str:
        return f"[{found[0]}]({up}gallery/{found[1]}.md)" if found[1] in names else found[0]

    def notebook(found: re.Match[str]) -> str:
        return found[0] if Path(found[2]).stem in names else found[1]

    text = _SHOWS.sub(picture, page.read_text())
    text = _EXAMPLE.sub(example, text).replace("](examples/)", "](gallery/index.md)")
    text = text.replace("](README.md)", "](index.md)").replace("](../README.md)", "](../index.md)")
    target.write_text(re.sub(r"\[([^\]]+)\]\(([^)]+\.ipynb)\)", notebook, text))


def _index(readme: Path, notebooks: Sequence[str]) -> str:
    """The README, with the lists for the menu."""
    listed = set(GUIDES) | {"README"}
    rows = re.findall(r"^\| \[[^]]+\]\((\w+)\.md\)", (readme.parent / "docs" / "README.md").read_text(), re.MULTILINE)
    more = [name for name in rows if name not in listed]
    lists = {
        "Begin": [f"docs/{name}" for name in GUIDES],
        "Examples": ["gallery/index", *(f"examples/{name}" for name in notebooks)],
        "More": ["docs/README", *(f"docs/{name}" for name in more)],
        "Project": ["reference", "CONTRIBUTING", "CHANGELOG"],
    }
    trees = (
        f"```{{toctree}}\n:hidden:\n:caption: {caption}\n\n" + "\n".join(entries) + "\n```"
        for caption, entries in lists.items()
    )
    return readme.read_text() + "\n" + "\n\n".join(trees) + "\n"


def _reference() -> str:
    """The page that links to pdoc's pages."""
    rows = "".join(
        f'<tr><td><a href="reference/{name.replace(".", "/")}.html"><code>{name}</code></a></td><td>{what}</td></tr>\n'
        for name, what in reference.MODULES.items()
    )
    return f"# API reference\n\nEvery public name, its parameters, units and errors.\n\n<table>\n{rows}</table>\n"


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--only", multiple=True, help="Run only the guide, example or notebook of this name. Repeat for more.")
def main(folder: Path, only: tuple[str, ...]) -> None:
    """Build the documentation into FOLDER."""
    known = {path.stem for path in (ROOT / "examples").iterdir()} | set(GUIDES)
    if unknown := set(only) - known:
        raise click.UsageError(f"there is no {', '.join(sorted(unknown))}; there are {', '.join(sorted(known))}")
    try:
        build(folder, only, lambda what: click.echo(f"glshadow: {what}", err=True))
    except (RuntimeError, ValueError, UserWarning, OSError) as error:
        raise click.ClickException(str(error)) from None
    click.echo(f"glshadow: the documentation is in {folder}/index.html", err=True)


if __name__ == "__main__":
    main()
