"""Notebook representations of frames, references, errors and studies."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Iterator
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import glshadow as gs
from glshadow.inline import SKY, visibility_picture
from glshadow.scoring.score import COLORS, Outcome

SIZE = (96, 54)
VOID = {"img", "br"}


class Balanced(HTMLParser):
    """Fails at a tag that is not closed in its place."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.stack: list[str] = []
        self.text = ""
        self.feed(text)
        self.close()
        assert self.stack == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in VOID:
            self.stack.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.stack.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data + " "


def decoded(data: bytes) -> NDArray[np.uint8]:
    with Image.open(io.BytesIO(data)) as picture:
        assert picture.format == "PNG"
        return np.asarray(picture)


def pictures(html: str) -> list[NDArray[np.uint8]]:
    return [decoded(base64.b64decode(data)) for data in re.findall(r"data:image/png;base64,([^\"]+)", html)]


@pytest.fixture(scope="module")
def scene() -> gs.Scene:
    built = gs.scenes.box().scene
    return replace(built, lights=(*built.lights, gs.PointLight(position=(2.0, 4.0, 1.0))))


@pytest.fixture(scope="module")
def frame(scene: gs.Scene) -> Iterator[gs.Frame]:
    with gs.Renderer("egl") as renderer:
        yield renderer.render(scene, size=SIZE, outputs=("image", "visibility"), samples=1)


@pytest.fixture(scope="module")
def truth(scene: gs.Scene) -> gs.Truth:
    return gs.trace(scene, size=SIZE, samples=1)


def test_frame_shows_its_image(frame: gs.Frame) -> None:
    data = frame._repr_png_()
    assert data is not None
    np.testing.assert_array_equal(decoded(data), frame.image)


def test_frame_without_image_shows_visibility(frame: gs.Frame) -> None:
    data = replace(frame, outputs={"visibility": frame.visibility})._repr_png_()
    assert data is not None
    shown = decoded(data)
    assert shown.shape == (2 * SIZE[1], SIZE[0], 3)
    np.testing.assert_array_equal(shown[SIZE[1] :], visibility_picture(frame.visibility[1]))
    assert replace(frame, outputs={})._repr_png_() is None


def test_reference_shows_every_light(truth: gs.Truth) -> None:
    html = truth._repr_html_()
    page = Balanced(html)
    shown = pictures(html)
    assert [picture.shape for picture in shown] == [(SIZE[1], SIZE[0], 3)] * 2
    for number, picture in enumerate(shown):
        seen = np.isfinite(truth.visibility[number])
        assert (picture[~seen] == SKY).all()
        lit = truth.visibility[number] == 1.0
        assert picture[seen & lit].min() > picture[seen & ~lit].max()
        share = truth.visibility[number][seen].mean()
        assert f"{share:.2%}" in page.text
    assert "directional" in page.text
    assert "point" in page.text


def test_error_shows_its_numbers_and_its_map(frame: gs.Frame, truth: gs.Truth) -> None:
    error = gs.measure(frame, truth)
    html = error._repr_html_()
    page = Balanced(html)
    for score in (*error.lights, error):
        assert f"{score.wrong:.4%}" in page.text
        assert f"{score.mean:.5f}" in page.text
    assert html.count("<tr>") == 1 + 2 + 1  # head, lights, all
    for number, picture in enumerate(pictures(html)):
        np.testing.assert_array_equal(picture, error.picture(number))
    assert f"rgb{COLORS[Outcome.ACNE]}" in html


def test_error_without_counted_pixels_shows_a_dash(scene: gs.Scene) -> None:
    below = [gs.DirectionalLight(direction=(0.0, 1.0, 0.0))]
    with gs.Renderer("egl") as renderer:
        dark = renderer.render(scene, lights=below, size=SIZE, outputs=("visibility",), samples=1)
    html = gs.measure(dark, gs.trace(scene, lights=below, size=SIZE, samples=1))._repr_html_()
    assert "nan" not in html
    assert "\N{EN DASH}" in Balanced(html).text


def test_study_shows_its_plot_and_its_front(scene: gs.Scene) -> None:
    from glshadow.study import run_study

    grid = [gs.Shadow(resolution=64), gs.Shadow(resolution=128)]
    study = run_study(scene, size=SIZE, grid=grid, repeats=1, backend="egl")
    html = study._repr_html_()
    assert html.count("<svg") == 2
    table = html[html.index("<table>") : html.index("</table>")]
    assert table.count("<tr>") == 1 + len(study.front(0)) + len(study.front(1))
    for result in (*study.front(0), *study.front(1)):
        assert result.name in table
        assert f"{result.score.wrong:.4%}" in table


# -- one line each


def test_every_repr_is_one_short_line(scene: gs.Scene, frame: gs.Frame, truth: gs.Truth) -> None:
    texture = np.zeros((16, 8, 4), np.uint8)
    material = gs.Material((0.5, 0.25, 1.0, 1.0), texture, gs.AlphaMode.MASK, 0.3, True)
    mesh = gs.Mesh(np.eye(3), np.array([[0, 1, 2]]), np.eye(3), np.zeros((3, 2)), material=material)  # type: ignore[arg-type]
    node = gs.Node(mesh, np.eye(4), "a\x1bb", casts=False)
    empty = gs.Mesh(np.eye(3), np.zeros((0, 3)))  # type: ignore[arg-type]
    many = gs.Scene((node,) * 500, name="many")
    error = gs.measure(frame, truth)
    for value in (material, mesh, empty, node, scene, many, frame, truth, error, *frame.used, gs.scenes.box()):
        assert "\n" not in repr(value)
        assert repr(value).isprintable()
        # six views of a point light
        assert len(repr(value)) < (2000 if isinstance(value, gs.Used) else 300), repr(value)
    assert repr(material) == "Material((0.5, 0.25, 1, 1), texture 8 x 16, MASK below 0.3, double-sided)"
    assert repr(mesh).startswith("Mesh(1 triangle, 3 vertices, normals, uv, from (0, 0, 0) to (1, 1, 1), Material(")
    assert repr(node) == r"Node('a\x1bb', 1 triangle, origin at (0, 0, 0), casts no shadow)"
    assert repr(many).startswith("Scene('many', 500 nodes, 500 triangles, 1 light, from (0, 0, 0) to (1, 1, 1): ")
    assert repr(many).endswith(", ...)")
    assert repr(frame) == "Frame('box', 96 x 54, 2 lights, outputs image, visibility)"
    assert repr(truth).startswith("Truth('box', 96 x 54, ")
    assert repr(error).startswith("Measurement(2 lights: wrong ")


def test_scene_shows_its_image(scene: gs.Scene) -> None:
    html = scene._repr_html_()  # type: ignore[operator]
    (picture,) = pictures(html)
    assert picture.shape == (360, 640, 3)
    assert picture.std() > 10  # lit and dark
    text = Balanced(html).text
    assert "box: 2 nodes, 14 triangles, 2 lights, from (" in text


def test_scene_that_cannot_be_rendered_shows_text(scene: gs.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise OSError("no driver")

    monkeypatch.setattr("glshadow.renderer.Renderer.render", fail)
    assert scene._repr_html_().startswith("<p>box: 2 nodes, 14 triangles")  # type: ignore[operator]


def test_scene_out_of_view_emits_no_warning(scene: gs.Scene) -> None:
    away = replace(scene, camera=gs.PerspectiveCamera((0, 50, 0), (0, 99, 1)))
    assert "<img" in away._repr_html_()  # type: ignore[operator]
