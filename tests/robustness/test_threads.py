"""Loading in many threads changes neither the process's warning filters nor its warnings."""

import re
import warnings
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import pytest

import glshadow as gs
from glshadow.errors import listening, warn

PACKAGE = Path(gs.__file__).parent

FILES = {
    "a.obj": "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl gone\nf 1 2 3\n",
    "a.off": "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    "a.stl": "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n",
    "a.ply": "ply\nformat ascii 1.0\ncomment TextureFile gone.png\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    "b.gltf": '{"asset": {"version": "2.0"}}',
}


def test_warning_filters_are_unchanged(tmp_path):
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)

    def work(turn):
        for number in range(5):
            with suppress(gs.SceneError):
                gs.load(tmp_path / list(FILES)[(turn + number) % len(FILES)])

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        before, shown = list(warnings.filters), warnings.showwarning
        with ThreadPoolExecutor(8) as pool:
            list(pool.map(work, range(8)))
        assert warnings.filters == before
        assert warnings.showwarning is shown
        caught.clear()
        warnings.warn("still here", stacklevel=1)
        assert [str(each.message) for each in caught] == ["still here"]


def test_warnings_are_collected_per_thread():
    heard: list[str] = []
    with listening(heard.append), ThreadPoolExecutor(1) as pool:
        warn("to the\nlistener")
        with pytest.warns(gs.GlshadowWarning, match="to all"):
            pool.submit(warn, "to all").result()
    assert heard == ["to the listener"]
    with pytest.warns(gs.GlshadowWarning, match="as ever"):
        warn("as ever")


def test_package_never_changes_warning_filters():
    forbidden = re.compile(r"\b(catch_warnings|simplefilter|filterwarnings|resetwarnings|showwarning)\b(?!` would)")
    found = [path.name for path in PACKAGE.rglob("*.py") if forbidden.search(path.read_text())]
    assert found == []
