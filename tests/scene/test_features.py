"""The table of what is drawn of glTF: each extension's row is what loading a file with it says."""

import json
import warnings
from pathlib import Path

import numpy as np
import pytest

from glshadow.errors import GlshadowWarning, SceneError
from glshadow.io.gltf.features import APPROXIMATED, CORE, DRAWN, EXTENSIONS, LEFT_OUT, REFUSED, can_be_required
from glshadow.io.load import load

from .glb import Glb

PLACES = [[-1, 0, 0], [1, 0, 0], [0, 1, 0]]
# of the registry of Khronos
RATIFIED = [
    "KHR_animation_pointer", "KHR_draco_mesh_compression", "KHR_gaussian_splatting", "KHR_interactivity", "KHR_lights_punctual",
    "KHR_materials_anisotropy", "KHR_materials_clearcoat", "KHR_materials_dispersion", "KHR_materials_emissive_strength",
    "KHR_materials_ior", "KHR_materials_iridescence", "KHR_materials_sheen", "KHR_materials_specular",
    "KHR_materials_transmission", "KHR_materials_unlit", "KHR_materials_variants", "KHR_materials_volume",
    "KHR_mesh_quantization", "KHR_node_hoverability", "KHR_node_selectability", "KHR_node_visibility", "KHR_texture_basisu",
    "KHR_texture_transform", "KHR_xmp_json_ld",
]  # fmt: skip


def using(folder: Path, *names: str, **top) -> Path:
    """A triangle in a scene with these extensions."""
    glb = Glb(nodes=[{"mesh": 0}], scenes=[{"nodes": [0], "extensions": {name: {} for name in names}}], **top)
    glb.mesh({"attributes": {"POSITION": glb.add(PLACES)}})
    return glb.save(folder / "a.glb")


def notes(path):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        load(path)
    assert {each.category for each in caught} <= {GlshadowWarning}
    return [str(each.message) for each in caught]


def test_every_ratified_extension_has_a_row():
    assert set(RATIFIED) <= set(EXTENSIONS)
    assert {each.how for each in (*EXTENSIONS.values(), *CORE.values())} <= {DRAWN, APPROXIMATED, LEFT_OUT, REFUSED}


@pytest.mark.parametrize("name", EXTENSIONS)
def test_row_is_what_loading_says(tmp_path, name):
    """What is drawn says nothing; what is approximated or left out is named once, with what differs."""
    how, remark = EXTENSIONS[name]
    said = notes(using(tmp_path, name, extensionsUsed=[name]))
    if how in (APPROXIMATED, LEFT_OUT):
        assert said == [f"a.glb: {name} is {how} ({remark})"]
    else:
        assert said == []


@pytest.mark.parametrize("name", [*EXTENSIONS, "VENDOR_new"])
def test_required(tmp_path, name):
    """A file that requires what is neither drawn nor approximated is refused by the extension's name."""
    path = using(tmp_path, extensionsUsed=[name], extensionsRequired=[name])
    known = EXTENSIONS.get(name)
    drawable = name.startswith("KHR_materials_") or (known is not None and known.how in (DRAWN, APPROXIMATED))
    assert can_be_required(name) == drawable
    if drawable:
        assert notes(path) == []
    else:
        with pytest.raises(SceneError, match=f"it needs the glTF extension {name}, which is not supported"):
            load(path)


def test_several_in_one_note_and_unknown_ones(tmp_path):
    names = ("KHR_materials_sheen", "VENDOR_new", "KHR_xmp_json_ld")
    assert notes(using(tmp_path, *names)) == [
        f"a.glb: KHR_materials_sheen is left out ({EXTENSIONS['KHR_materials_sheen'].remark}); VENDOR_new is left out (not known)"
    ]
    (note,) = notes(using(tmp_path, *(f"VENDOR_{k}" for k in range(500))))
    assert note.endswith("VENDOR_19 is left out (not known); ...")


def test_declared_but_unused_extensions_are_no_loss(tmp_path):
    assert notes(using(tmp_path, extensionsUsed=["KHR_materials_sheen", "VENDOR_new"])) == []


def test_several_scenes(tmp_path):
    glb = Glb(nodes=[{"mesh": 0, "name": "a"}, {"mesh": 0, "name": "b"}], scenes=[{"nodes": [0]}, {"nodes": [1]}])
    glb.mesh({"attributes": {"POSITION": glb.add(PLACES)}})
    glb.json["scene"] = 1
    path = glb.save(tmp_path / "a.glb")
    assert notes(path) == ["a.glb: it has 2 scenes: the default one is drawn"]
    with pytest.warns(GlshadowWarning):
        assert [node.name for node in load(path).nodes] == ["b"]


# --- the JSON itself ---


def plain(folder: Path) -> Path:
    glb = Glb(nodes=[{"mesh": 0}])
    glb.mesh({"attributes": {"POSITION": glb.add(PLACES)}})
    data = {**glb.json, "scenes": [{"nodes": [0]}], "buffers": [{"uri": "a.bin", "byteLength": len(glb.binary)}]}
    (folder / "a.bin").write_bytes(glb.binary)
    (folder / "a.gltf").write_text(json.dumps(data))
    return folder / "a.gltf"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-32"])
def test_byte_order_marks(tmp_path, encoding):
    path = plain(tmp_path)
    path.write_bytes(path.read_text().encode(encoding))
    np.testing.assert_array_equal(load(path).nodes[0].mesh.positions, PLACES)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"scene": 0', '"scene": 0, "scene": 0', "an object has the key 'scene' more than once"),
        ('"mesh": 0', '"mesh": 0, "x": {"y": 1, "y": 2}', "an object has the key 'y' more than once"),
        ('"scene": 0', '"scene": ' + "9" * 5000, "it has an integer of 5000 digits"),
        ('"scene": 0', '"scene": -' + "9" * 301, "it has an integer of 301 digits"),
        ('"scene": 0', '"scene": 0, "x": ' + "[" * 100_000, "it is nested too deeply"),
        ('"scene": 0', '"scene": 0,', "its JSON cannot be read"),
        ('"scene": 0', '"scene": ' + "9" * 300, "the default scene refers to scenes"),
        ('"scene": 0', '"name": "\udcff"', "its JSON is not UTF-8"),
    ],
    ids=range(8),
)
def test_json_that_is_refused(tmp_path, old, new, message):
    path = plain(tmp_path)
    path.write_bytes(path.read_text().replace(old, new).encode("utf-8", "surrogateescape"))
    with pytest.raises(SceneError, match=message) as raised:
        load(path)
    assert "sys.set_int_max_str_digits" not in str(raised.value)
