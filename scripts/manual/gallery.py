"""The gallery: runs every example in its own folder, and writes a page with its image, output and source."""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

from scripts.manual.sessions import headless

THUMBNAIL = (320, 200)


@dataclass(frozen=True)
class Shown:
    """An example and its output.

    Attributes
    ----------
    title, look, more : str
        Its first sentence, what to look at, and the rest of its docstring.
    source : str
        Source code without the docstring.
    picture : Path or None
    said : str
        Its output.
    """

    name: str
    title: str
    look: str
    more: str
    source: str
    picture: Path | None
    said: str


def run_example(path: Path, folder: Path) -> Shown:
    """Run an example in a folder.

    Raises
    ------
    RuntimeError
        If it fails, with its output.
    """
    folder.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, str(path)]
    done = subprocess.run(command, cwd=folder, env=headless(), capture_output=True, text=True, timeout=600)
    if done.returncode != 0:
        raise RuntimeError(f"{path.name}: {done.stderr[-3000:]}")
    source = path.read_text()
    tree = ast.parse(source)
    words = ast.get_docstring(tree) or ""
    first, _, more = words.partition("\n")
    before, _, look = first.partition("Look at:")
    title, *others = re.split(r"(?<=[.?]) ", before.strip())
    end = tree.body[0].end_lineno or 0
    picture = folder / f"{path.stem}.png"
    return Shown(
        name=path.stem,
        title=title.rstrip("."),
        look=look.strip(),
        more=" ".join([*others, more.strip()]),
        source="\n".join(source.splitlines()[end:]).strip(),
        picture=picture if picture.exists() else None,
        said=done.stdout,
    )


def write_gallery(shown: Sequence[Shown], folder: Path) -> None:
    """Write pages in Markdown, with images next to them."""
    folder.mkdir(parents=True, exist_ok=True)
    cards = []
    for each in shown:
        (folder / f"{each.name}.md").write_text(_page(each, folder))
        link = f"{each.name}.md"
        said = "\n".join(each.said.splitlines()[:6])
        picture = f"[![]({each.name}_small.jpg)]({link})" if each.picture else f"```text\n{said}\n```"
        cards.append(f":::{{container}} card\n{picture}\n\n[{each.title}]({link})\n:::")
    pages = "\n".join(each.name for each in shown)
    text = "\n\n".join(cards)
    (folder / "index.md").write_text(
        "# Gallery\n\nEvery example, run when these pages were built: its image, its output, and its source. The files are in"
        f" `examples/`.\n\n::::{{container}} cards\n\n{text}\n\n::::\n\n```{{toctree}}\n:hidden:\n\n{pages}\n```\n"
    )


def _page(shown: Shown, folder: Path) -> str:
    parts = [f"# {shown.title}", f"*Look at*: {shown.look}" if shown.look else "", shown.more]
    if shown.picture is not None:
        shutil.copy(shown.picture, folder / shown.picture.name)
        small = Image.open(shown.picture).convert("RGB")
        small.thumbnail(THUMBNAIL)
        small.save(folder / f"{shown.name}_small.jpg", quality=88)
        parts.append(f"![{shown.title}]({shown.picture.name})")
    if shown.said.strip():
        parts.append(f"It prints:\n\n```text\n{shown.said.rstrip()}\n```")
    parts.append(f"`examples/{shown.name}.py`:\n\n```python\n{shown.source.rstrip()}\n```")
    return "\n\n".join(part for part in parts if part) + "\n"
