"""Many images of one command: their names and their journal; written atomically, and existing ones are kept."""

from __future__ import annotations

import string
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from glshadow.cli.bar import Bar
from glshadow.cli.running import Work
from glshadow.errors import SettingsError
from glshadow.journal import Journal, Kept, digest_of, digest_of_file
from glshadow.numbered import has_field, numbered
from glshadow.video import SUFFIXES as VIDEOS

if TYPE_CHECKING:
    from glshadow.scene.nodes import Scene


def pattern(path: Path) -> Callable[[int], Path]:
    """A function from number to file, for a name with one field such as view_{:03d}.png.

    Raises
    ------
    click.UsageError
        As for `numbered`.
    """
    try:
        name = numbered("with --orbit or --animate, -o", path.name)
    except SettingsError as error:
        raise click.UsageError(str(error)) from None
    return lambda number: path.with_name(name(number))


def named_after(stem: str, several: bool) -> Path:
    """The default file name of the image; of several a name pattern."""
    doubled = "".join(2 * letter if letter in "{}" else letter for letter in stem)
    return Path(f"{doubled}_{{:03d}}.png" if several else f"{stem}.png")


def refuse_field(path: Path) -> None:
    """Refuse a number field in the name of a single image."""
    if has_field(path.name):
        raise click.UsageError(f"{path.name!r} has a field for a number: that needs --orbit N or --animate FPS")


def refuse_video(path: Path) -> None:
    """Refuse a file for moving images for a single image."""
    if path.suffix.lower() in VIDEOS:
        raise click.UsageError(f"{path.name!r} is a video: that needs render --orbit N or --animate FPS")


def kept_beside(path: Path) -> Kept:
    """The images of a name pattern that already exist, by the journal next to them."""
    literal = "".join(text for text, *_ in string.Formatter().parse(path.name))
    return Kept(Journal(path.with_name(f"{Path(literal).stem}.orbit.jsonl")))


def request_of(scene: Scene, *facts: Any) -> str:
    """Digest of everything that affects the images."""
    from glshadow import __version__
    from glshadow.study.fingerprint import fingerprint

    flags = [(node.casts, node.receives, node.catches) for node in scene.nodes]
    return digest_of(__version__, fingerprint(scene), flags, facts)


def make_all(
    work: Work,
    files: Sequence[Path],
    kept: Kept,
    request: str,
    draw: Callable[[Sequence[int]], Iterable[tuple[int, Any]]],
    name: str,
) -> list[dict[str, Any]]:
    """Draw the missing images and add a report line for each. `draw`: numbers -> numbers and frames."""
    if any(kept.stale(path.name, request) for path in files):
        work.say("existing images belong to another request: rendering them again")
    missing = [number for number, path in enumerate(files) if not kept.has(path.name, request)]
    if len(missing) < len(files):
        work.say(f"{len(files) - len(missing)} of {len(files)} images exist already")
    anew = set(missing)
    rows = [{"path": str(path), "made": number in anew} for number, path in enumerate(files)]
    with Bar(work) as bar:
        bar(len(files) - len(missing), len(files), name)
        for done, (number, frame) in enumerate(draw(missing) if missing else (), start=1):
            frame.save(files[number])
            kept.add(request, {files[number].name: digest_of_file(files[number])})
            bar(len(files) - len(missing) + done, len(files), files[number].name)
    return rows
