"""Files that a model names: none outside its folder, none read beyond what is used, and all of them limited in total."""

from __future__ import annotations

import json
import re
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshadow as gs
from glshadow import image
from glshadow.io.limits import Budget, Limits
from glshadow.io.load import read_scene
from glshadow.io.mesh_files.beside import Beside

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1]], dtype="<f4").tobytes()
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 3/3 2/2\n"
GIB = 1 << 30


def gltf(path: Path, uri: str = "a.bin", length: int = 36, **more: Any) -> Path:
    """A triangle whose buffer is another file."""
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}], "materials": [{}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": length, "uri": uri}], **more,
    }  # fmt: skip
    path.write_text(json.dumps(document))
    return path


def sparse(path: Path, size: int, head: bytes = b"") -> Path:
    """A sparse file of `size` bytes that occupies no disk space."""
    with path.open("wb") as file:
        file.write(head)
        file.truncate(size)
    return path


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The model's folder; beside it are files that a model must not read."""
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside/secret.bin").write_bytes(CORNERS)
    (tmp_path / "outside/secret.mtl").write_text("newmtl m\nKd 1 0 0\n")
    image.write(tmp_path / "outside/secret.png", np.full((2, 2, 3), 9, np.uint8))
    (tmp_path / "models").mkdir()
    return tmp_path / "models"


@pytest.mark.parametrize("through", ["file", "folder", "chain"])
def test_symlinks_out_of_the_folder_are_refused(folder: Path, through: str) -> None:
    def link(ending: str) -> str:
        target = folder.parent / "outside" / f"secret.{ending}"
        if through == "folder":
            if not (folder / "sub").exists():
                (folder / "sub").symlink_to(target.parent)
            return f"sub/secret.{ending}"
        (folder / f"b.{ending}").symlink_to(target)
        (folder / f"a.{ending}").symlink_to(target if through == "file" else f"b.{ending}")
        return f"a.{ending}"

    with pytest.raises(gs.SceneError, match=r"buffers\[0\]: the file '.*' is a link out of the model's folder"):
        gs.load(gltf(folder / "a.gltf", link("bin")))
    (folder / "c.bin").write_bytes(CORNERS + bytes(24))
    textured = gltf(
        folder / "b.gltf", "c.bin", images=[{"uri": link("png")}], textures=[{"source": 0}],
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
    )  # fmt: skip
    with pytest.warns(gs.GlshadowWarning, match="link out of the model's folder.*drawn without this texture"):
        assert gs.load(textured).nodes[0].mesh.material.texture is None
    (folder / "c.mtl").write_text(f"newmtl m\nmap_Kd {'sub/secret.png' if through == 'folder' else 'a.png'}\n")
    for library in (link("mtl"), "c.mtl"):
        (folder / "a.obj").write_text(f"mtllib {library}\nusemtl m\n{TRIANGLE}")
        with pytest.warns(gs.GlshadowWarning, match="is a link out of the model's folder: drawn without it"):
            material = gs.load(folder / "a.obj").nodes[0].mesh.material
        assert (material.color[:3], material.texture) == ((0.8, 0.8, 0.8), None)


def test_symlinks_inside_the_folder_are_followed(folder: Path, tmp_path: Path) -> None:
    """The model itself, and its folder, may be links."""
    (folder / "store").mkdir()
    (folder / "store/data").write_bytes(CORNERS)
    (folder / "a.bin").symlink_to("store/data")
    gltf(folder / "a.gltf")
    (tmp_path / "link").symlink_to(folder)
    for path in (folder / "a.gltf", tmp_path / "link/a.gltf"):
        assert len(gs.load(path).nodes) == 1
    (tmp_path / "outside/a.gltf").symlink_to(folder / "a.gltf")
    with pytest.raises(gs.SceneError, match=r"'a\.bin' is missing"):
        gs.load(tmp_path / "outside/a.gltf")


def test_buffer_is_read_up_to_its_declared_length(folder: Path) -> None:
    gltf(folder / "a.gltf")
    sparse(folder / "a.bin", 20 * GIB, CORNERS)
    budget = Budget()
    scene = read_scene(folder / "a.gltf", budget)
    np.testing.assert_array_equal(scene.nodes[0].mesh.positions.astype("<f4").tobytes(), CORNERS)
    assert budget.read_bytes == (folder / "a.gltf").stat().st_size + 36


def huge_buffer(folder: Path) -> Path:
    sparse(folder / "a.bin", 4 * GIB, CORNERS)
    return gltf(folder / "a.gltf", length=4 * GIB)


def huge_texture(folder: Path) -> Path:
    image.write(folder / "small.png", np.full((2, 2, 3), 9, np.uint8))
    sparse(folder / "a.png", 4 * GIB, (folder / "small.png").read_bytes())
    (folder / "a.mtl").write_text("newmtl m\nmap_Kd a.png\n")
    (folder / "a.obj").write_text(f"mtllib a.mtl\nusemtl m\n{TRIANGLE}")
    return folder / "a.obj"


def huge_gltf_texture(folder: Path) -> Path:
    (folder / "a.bin").write_bytes(CORNERS)
    sparse(folder / "a.jpg", 4 * GIB, b"\xff\xd8")
    return gltf(
        folder / "a.gltf", images=[{"uri": "a.jpg"}], textures=[{"source": 0}],
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
    )  # fmt: skip


def huge_library(folder: Path) -> Path:
    sparse(folder / "a.mtl", 4 * GIB)
    (folder / "a.obj").write_text(f"mtllib a.mtl\n{TRIANGLE}")
    return folder / "a.obj"


LIMIT = r"4.29497e\+09 bytes of the file and of the files that it references; the limit is 2.14748e\+09.*Limits\(file_bytes=\.\.\.\)"
HUGE: dict[str, tuple[Callable[[Path], Path], str]] = {
    "buffer": (huge_buffer, rf"buffers\[0\]: {LIMIT}"),
    "texture of an OBJ": (huge_texture, f"the image 'a.png': {LIMIT}"),
    "texture of a glTF": (huge_gltf_texture, rf"images\[0\]: {LIMIT}"),
    "material library": (huge_library, f"the file 'a.mtl': {LIMIT}"),
    "GLB of zeros": (lambda folder: sparse(folder / "a.glb", 4 * GIB), "not a GLB file: it begins with .* has 4294967296 bytes"),
    "GLB": (lambda folder: sparse(folder / "a.glb", 4 * GIB - 4, struct.pack("<4sII", b"glTF", 2, 4 * GIB - 4)), f"the file: {LIMIT}"),
    **{ending: ((lambda folder, ending=ending: sparse(folder / f"a.{ending}", 4 * GIB)), f"the file: {LIMIT}")
       for ending in ("gltf", "obj", "ply", "stl", "off")},
}  # fmt: skip


@pytest.mark.parametrize("name", HUGE)
def test_huge_file_is_refused_before_reading(folder: Path, name: str) -> None:
    """In a process that may address 4 GB less than reading would need."""
    make, said = HUGE[name]
    path = make(folder)
    code = (
        "import resource, sys\nimport glshadow as gs\nfrom glshadow.io.load import load\n"
        "resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))\n"
        "try: load(sys.argv[1])\nexcept gs.SceneError as error: print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(path)], capture_output=True, text=True, timeout=120, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert re.search(said, done.stdout), done.stdout


def test_total_file_size_is_limited(folder: Path) -> None:
    (folder / "a.bin").write_bytes(CORNERS)
    path = gltf(folder / "a.gltf")
    size = path.stat().st_size + 36
    assert gs.load(path, limits=Limits(file_bytes=size)).nodes
    with pytest.raises(gs.SceneError, match="the limit is"):
        gs.load(path, limits=Limits(file_bytes=size - 1))


def test_read_and_missing_files_are_recorded(folder: Path) -> None:
    """The files that a batch compares before it reuses an image."""
    image.write(folder / "Red.png", np.full((2, 2, 3), 9, np.uint8))
    (folder / "a.mtl").write_text("newmtl m\nmap_Kd red.png\nnewmtl n\nmap_Kd none.png\n")
    (folder / "a.obj").write_text(f"mtllib a.mtl\nusemtl m\n{TRIANGLE}usemtl n\nf 1/1 2/2 3/3\n")
    budget = Budget()
    with pytest.warns(gs.GlshadowWarning):
        read_scene(folder / "a.obj", budget)
    assert {path.name for path in budget.files} == {"a.obj", "a.mtl", "Red.png", "red.png", "none.png"}


def chunks(folder: Path, count: int) -> Path:
    """A GLB of a triangle whose buffer follows so many empty chunks of an unknown kind."""
    text = gltf(folder / "a.gltf").read_text().replace(', "uri": "a.bin"', "").encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", 0, 5) * count
    body += struct.pack("<II", 36, 0x004E4942) + CORNERS
    (folder / "a.glb").write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)
    return folder / "a.glb"


def test_unknown_glb_chunks_are_not_kept(folder: Path) -> None:
    assert len(gs.load(chunks(folder, 3)).nodes) == 1
    with pytest.raises(gs.SceneError, match="neither an uri nor a binary chunk"):
        gs.load(chunks(folder, 3_000_000))


def seconds(call: Callable[[], object]) -> float:
    """Processor time, the minimum of three."""
    taken = []
    for _ in range(3):
        start = time.process_time()
        call()
        taken.append(time.process_time() - start)
    return min(taken)


def test_missing_file_names_cost_linear_time(folder: Path) -> None:
    """Four times as many take four times as long; a search through all earlier names would take fifteen times (measured)."""

    def look(count: int) -> None:
        beside = Beside(folder, [], Budget())
        for number in range(count):
            assert beside.path(f"{number}.png") is None

    assert seconds(lambda: look(20_000)) < 8.0 * seconds(lambda: look(5_000))


@pytest.mark.filterwarnings("ignore::glshadow.GlshadowWarning")
@pytest.mark.parametrize("space", [" ", "\n{word} "], ids=["in a line", "in lines"])
def test_material_libraries_beyond_the_hundredth_are_ignored(folder: Path, space: str) -> None:
    """They cost no more than names of materials; with a look-up on the disk for each, 18 and 95 times as much (measured)."""

    def load(word: str) -> None:
        names = space.format(word=word).join(f"m{k}.mtl" for k in range(100_000))
        (folder / "a.obj").write_text(f"{word} {names}\n{TRIANGLE}")
        gs.load(folder / "a.obj")

    assert seconds(lambda: load("mtllib")) < 4.0 * seconds(lambda: load("usemtl"))


def test_overlong_file_name_is_missing(folder: Path) -> None:
    (folder / "a.obj").write_text(f"mtllib {'x/' * 500_000}\n{TRIANGLE}")
    with pytest.warns(gs.GlshadowWarning, match="is missing"):
        gs.load(folder / "a.obj")
