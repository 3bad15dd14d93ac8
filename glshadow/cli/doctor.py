"""glshadow doctor: check OpenGL on this machine."""

from __future__ import annotations

from typing import Any

import click

from glshadow.cli.options import common
from glshadow.cli.running import FAILED, Work
from glshadow.cli.sections import Command

LIMITS = {  # attribute of Caps: label
    "max_texture_size": "largest texture",
    "max_renderbuffer_size": "largest renderbuffer",
    "max_texture_buffer_size": "largest buffer texture",
    "max_color_attachments": "colour attachments",
    "clip_control": "clip control",
    "texture_gather": "shadow gather",
    "software": "renders on the CPU",
    "timestamps": "timestamps",
}


@click.command(cls=Command)
@common
def command(as_json: bool, debug: bool) -> None:
    """Check which OpenGL backends work on this machine, with their driver, limits and formats, and why others do not.

    Exit code 1 if no backend works.
    """
    with Work(as_json, debug) as work:
        with work.stage("examine", "trying each backend"):
            from glshadow.doctor import examine

            found = examine()
        work.finish(found)
        if not as_json:
            click.echo("\n".join(_lines(found)))
        if found["auto"] is None:
            work.say("error: no OpenGL backend works; follow a remedy above")
            raise click.exceptions.Exit(FAILED)


def _lines(found: dict[str, Any]) -> list[str]:
    lines = [f"glshadow {found['glshadow']}, Python {found['python']}, {found['platform']}", ""]
    for name, report in found["backends"].items():
        taken = "   <- used by --backend auto" if name == found["auto"] else ""
        lines += [f"{name}: {'works' if report['works'] else 'does not work'}{taken}", *_backend(report), ""]
    lines += [
        f"device {each['number']}: {each['name']}; {each['driver'] or 'does not work'}   (--device {each['number']})"
        for each in found["devices"]
    ]
    lines += [""] if found["devices"] else []
    have = [f"{name} {version}" for name, version in found["packages"].items() if version]
    lines.append(f"packages: {', '.join(have)}")
    lines += [f"missing:  {name:<12} {how}" for name, how in found["missing"].items()]
    return lines


def _backend(report: dict[str, Any]) -> list[str]:
    if not report["works"]:
        return [f"  why      {report['reason']}", *([f"  remedy   {report['remedy']}"] if report["remedy"] else [])]
    caps = report["caps"]
    formats = report["depth_formats"] | report["color_formats"]
    broken = [name for name, works in formats.items() if not works]
    limits = [f"{title} {_word(caps[name])}" for name, title in LIMITS.items() if name in caps]
    return [
        f"  driver   {caps['renderer']}",
        f"           {caps['vendor']}, OpenGL {caps['version']}",
        f"  limits   {', '.join(limits[:3])}",
        f"           {', '.join(limits[3:])}",
        f"  formats  {' '.join(name for name, works in formats.items() if works)}"
        + (f"; not working: {' '.join(broken)}" if broken else ""),
    ]


def _word(value: Any) -> str:
    return ("yes" if value else "no") if isinstance(value, bool) else str(value)
