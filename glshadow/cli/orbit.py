"""glshadow render --orbit: many pictures round the model, each whole or not there, and none made twice."""

from __future__ import annotations

import hashlib
import re
import string
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glshadow.cli.bar import Bar
from glshadow.cli.running import Work

if TYPE_CHECKING:
    from glshadow.core.cameras import Camera
    from glshadow.lights import Light
    from glshadow.scene.nodes import Scene


MOST_PICTURES = 100_000

_WHOLE = re.compile(r"0?[0-9]{0,2}[bdoxX]?")
"""How a field may write the picture's number: 1e5 pictures have five digits."""


def pattern(path: Path) -> Callable[[int], Path]:
    """Number -> file, for a name with one field such as view_{:03d}.png.

    Raises
    ------
    click.UsageError
        If it has no field, several, or one that writes no whole number: two pictures could share a name.
    """
    try:
        fields = [(name, spec, how) for _, name, spec, how in string.Formatter().parse(path.name) if name is not None]
        if (
            len(fields) != 1
            or fields[0][0] not in ("", "0")
            or fields[0][2]
            or not _WHOLE.fullmatch(fields[0][1] or "")
        ):
            raise ValueError
        names = {path.name.format(number) for number in (0, 1)}
    except (ValueError, IndexError, KeyError):
        names = set()
    if len(names) != 2 or any("/" in name for name in names):
        raise click.UsageError(
            f"with --orbit, -o needs a name with one field for the picture's number, such as view_{{:03d}}.png, got {path.name!r}"
        )
    return lambda number: path.with_name(path.name.format(number))


def named_after(stem: str, orbit: bool) -> Path:
    """The picture's file where none is given; with `orbit` its name is a pattern."""
    return Path(
        "".join(2 * letter if letter in "{}" else letter for letter in stem) + "_{:03d}.png" if orbit else f"{stem}.png"
    )


def refuse_field(path: Path) -> None:
    """A field that is asked for means nothing without --orbit."""
    if "{" in path.name or "}" in path.name:
        raise click.UsageError(f"{path.name!r} has a field for a number: that needs --orbit N")


class Kept:
    """Which pictures of a request are there, by a journal beside them."""

    def __init__(self, path: Path, request: str) -> None:
        from glshadow.study.journal import Journal

        literal = "".join(text for text, *_ in string.Formatter().parse(path.name))
        self._journal = Journal(path.with_name(f"{Path(literal).stem}.orbit.jsonl"))
        self._request = request

    def stale(self, path: Path) -> bool:
        """Whether a picture is there that was made for another request."""
        return (
            path.is_file() and self._journal.records.get(path.name, {}).get("request", self._request) != self._request
        )

    def has(self, path: Path) -> bool:
        """Whether a picture is of this request, and still what was written."""
        record = self._journal.records.get(path.name, {})
        return record.get("request") == self._request and path.is_file() and record.get("sha256") == _sha(path)

    def add(self, path: Path) -> None:
        """It was written."""
        self._journal.add({"key": path.name, "request": self._request, "sha256": _sha(path)})


def _sha(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def request_of(scene: Scene, cameras: Sequence[Camera], lights: Sequence[Light], *options: Any) -> str:
    """Digest of all that decides the pictures."""
    from glshadow import __version__
    from glshadow.study.journal import fingerprint

    flags = [(node.casts, node.receives, node.catches) for node in scene.nodes]
    text = repr((__version__, fingerprint(scene), flags, cameras, lights, options))
    return hashlib.sha256(text.encode()).hexdigest()


def make_all(
    work: Work, files: Sequence[Path], kept: Kept, draw: Callable[[Sequence[int]], Iterable[tuple[int, Any]]], name: str
) -> list[dict[str, Any]]:
    """Draw what is missing; a line of the report for each picture. `draw`: numbers -> numbers and frames."""
    if any(map(kept.stale, files)):
        work.say("pictures of another request are there: they are made anew")
    missing = [number for number, path in enumerate(files) if not kept.has(path)]
    if len(missing) < len(files):
        work.say(f"{len(files) - len(missing)} of {len(files)} pictures are there already")
    anew = set(missing)
    rows = [{"path": str(path), "made": number in anew} for number, path in enumerate(files)]
    with Bar(work) as bar:
        bar(len(files) - len(missing), len(files), name)
        for done, (number, frame) in enumerate(draw(missing) if missing else (), start=1):
            frame.save(files[number])
            kept.add(files[number])
            bar(len(files) - len(missing) + done, len(files), files[number].name)
    return rows
