"""Text from a file that would control a terminal, reverse its writing direction or cannot be encoded is escaped wherever it is shown."""

import copy
import io
import json
import pickle
import warnings

import pytest
from click.testing import CliRunner
from rich.console import Console

import glshadow as gs
from glshadow.cli import main
from glshadow.cli.running import Progress
from glshadow.errors import printable
from glshadow.inline import figure, table, words

from .mutated_files import box_document, pack

TITLE, TURNED = "\x1b]0;owned\x07", "\u202egnp.exe"
HOSTILE = f"{TITLE}{TURNED}\u2066\u200b\u2028\r\n\t\x9b31m\ud800\x7f[bold]<b>&"
FORBIDDEN = ("\x1b", "\x07", "\x9b", "\u202e", "\u2066", "\u200b", "\u2028", "\ud800", "\x7f", "\r")


def clean(text: str, lines: bool = False) -> bool:
    """Whether a text is printable; `lines`: except for line feeds and tabs, which a driver's log contains."""
    return (text.replace("\n", "").replace("\t", "") if lines else text).isprintable()


def test_printable() -> None:
    assert printable("Stra\u00dfe \u65e5\u672c \U0001f40d") == "Stra\u00dfe \u65e5\u672c \U0001f40d"
    assert printable(TITLE) == r"\x1b]0;owned\x07"
    assert printable(TURNED) == r"\u202egnp.exe"
    assert printable("a\nb", keep="\n") == "a\nb"
    assert printable("\ud800\u2029\x85") == r"\ud800\u2029\x85"
    for number in (
        *range(0x20),
        *range(0x7F, 0xA0),
        *range(0x200B, 0x2010),
        *range(0x2028, 0x202F),
        *range(0x2066, 0x206A),
    ):
        assert printable(chr(number)).isascii(), hex(number)
        assert printable(chr(number)).isprintable(), hex(number)
    assert printable(printable(HOSTILE)) == printable(HOSTILE)


@pytest.mark.parametrize("kind", [gs.GlshadowError, gs.SceneError, gs.SettingsError, gs.ShaderError, gs.MissingOutput])
def test_error_messages_are_printable(kind: type[gs.GlshadowError]) -> None:
    error = kind(f"first {HOSTILE}\nsecond")
    assert clean(str(error), lines=True)
    assert ("\n" in str(error)) == (kind is not gs.SceneError)  # from a file, one line
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
    assert str(copy.copy(error)) == str(error)
    assert len(str(kind("x" * 10**6))) < 2100
    assert str(kind("head " + "x" * 10**6 + " tail")).endswith("tail")


def hostile_files(folder):
    document, binary = box_document()
    files = {}

    def add(name, **changes):
        changed = copy.deepcopy(document)
        for key, value in changes.items():
            changed[key] = value
        files[name] = pack(changed, binary)

    nodes = copy.deepcopy(document["nodes"])
    for node in nodes:
        node["name"] = HOSTILE
    add("names.glb", nodes=nodes, meshes=[{**mesh, "name": HOSTILE} for mesh in document["meshes"]])
    add("extension.glb", extensionsRequired=[HOSTILE])
    add("used.glb", extensionsUsed=[HOSTILE], extensions={HOSTILE: {}})
    add("image.glb", images=[{"uri": f"{TITLE}{TURNED}.png"}])
    add("texture.glb", textures=[{"extensions": {HOSTILE: {}}}])
    add("camera.glb", cameras=[{"type": HOSTILE}])
    add("light.glb", extensions={"KHR_lights_punctual": {"lights": [{"type": HOSTILE}] * 3}})
    add("accessor.glb", accessors=[{**each, "type": HOSTILE} for each in document["accessors"]])
    add("version.glb", asset={"version": HOSTILE})
    add("buffer.glb", buffers=[{"byteLength": 8, "uri": HOSTILE}])
    words_of_obj = f"mtllib {TITLE}.mtl\no {TITLE}{TURNED}\nusemtl {TITLE}{TURNED}\nmap_Kd {TURNED}\n"
    files["a.obj"] = (words_of_obj + "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2\n").encode()
    files["b.obj"] = f"v 0 0 {TITLE}\nf {TITLE}0 1 2\n".encode()
    files["c.obj"] = f"mtllib c.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl {TURNED}\nf 1/1 2/1 3/1\n".encode()
    (folder / "c.mtl").write_text(f"newmtl {TURNED}\nmap_Kd {TITLE}{TURNED}.png\nKd 9 9 9\n")
    files["a.ply"] = f"ply\nformat {TITLE} 1.0\nelement vertex 3\nend_header\n".encode()
    files["a.off"] = f"OFF\n{TITLE} 1 0\n".encode()
    files["a.stl"] = f"solid {TITLE}\nfacet normal {TITLE}\n".encode()
    files[f"{TITLE}{TURNED}.glb"] = pack(*box_document())
    for name, data in files.items():
        (folder / name).write_bytes(data)
    return files


def test_messages_about_a_file_are_printable(tmp_path):
    said: list[str] = []
    refused = 0
    for name in hostile_files(tmp_path):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                scene = gs.load(tmp_path / name)
                said.append(repr(scene))
            except gs.SceneError as error:
                refused += 1
                said.append(str(error))
        said += [str(each.message) for each in caught]
    assert [text for text in said if not clean(text)] == []
    assert refused >= 5
    assert sum(r"\x1b" in text for text in said) >= 8, said  # it was shown, escaped


def test_command_prints_escapes_and_json_keeps_the_text(tmp_path, monkeypatch):
    hostile_files(tmp_path)
    monkeypatch.chdir(tmp_path)
    name = f"{TITLE}{TURNED}"
    for model in (f"{name}.glb", "image.glb", "names.glb", "extension.glb", "a.obj", f"{name}.gltf"):
        result = CliRunner().invoke(main, ["render", model, "--size", "16x12", "-o", "a.png"])
        assert clean(result.output, lines=True), (model, result.output)
    result = CliRunner().invoke(main, ["render", f"{name}.glb", "--size", "16x12", "-o", "a.png", "--json"])
    assert result.stdout.isascii()
    assert json.loads(result.stdout)["scene"]["name"] == name


def test_progress_interprets_no_markup():
    """Neither rich's markup nor its emoji codes, nor terminal sequences."""
    progress = Progress()
    stream = io.StringIO()

    class Display:
        console = Console(file=stream, force_terminal=True, width=200)
        shown = ""

        def update(self, _: object, description: str) -> None:
            Display.shown = description

    progress._display, progress._task = Display(), 0
    progress.say(f"[bold]a[/bold] [link=https://x]b[/link] :snake: {HOSTILE}")
    progress.stage(f"loading {HOSTILE}")
    assert stream.getvalue().startswith("[bold]a[/bold] [link=https://x]b[/link] :snake: ")
    assert clean(stream.getvalue().rstrip("\n"))
    assert clean(Display.shown)


def test_page_escapes_names(tmp_path):
    scene = gs.scenes.plane().scene
    path = gs.export_page(gs.Scene(scene.nodes, name=HOSTILE), tmp_path, lights=gs.DirectionalLight())
    page = path.read_text(encoding="utf-8")
    assert not any(each in page for each in FORBIDDEN)
    assert words(HOSTILE) in page


def test_comparison_prints_escaped_names():
    found = gs.compare(gs.scenes.plane().scene, {f"{HOSTILE}1": "hard", f"{HOSTILE}2": "pcf:1"}, size=(24, 16))
    assert clean(repr(found))
    assert clean(str(found), lines=True)
    assert len(str(found).splitlines()) == 2
    assert not any(each in found._repr_html_() for each in FORBIDDEN)
    assert found.image.shape[2] == 3
    assert found[f"{HOSTILE}1"].name == f"{HOSTILE}1"


def test_html_escapes_names():
    import numpy as np

    for html in (words(HOSTILE), figure(np.zeros((2, 2, 3), np.uint8), HOSTILE), table([HOSTILE], [[HOSTILE]])):
        assert not any(each in html for each in FORBIDDEN)
        assert "<b>" not in html
        assert "&lt;b&gt;&amp;" in html
