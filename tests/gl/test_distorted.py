"""Images of lenses with distortion: pixels against the forward model, and what cannot be mapped."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import glshadow as gs
from glshadow.errors import SettingsError

SIZE = (320, 240)
K = np.array([[260.0, 0.0, 171.3], [0.0, 250.0, 113.8], [0.0, 0.0, 1.0]])
R = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]])  # the camera at z = 3 looks along -z, x right, y up
T = np.array([0.0, 0.0, 3.0])
CAMERA = gs.PerspectiveCamera.from_opencv(K, R, T, SIZE)
BARREL = gs.BrownDistortion(-0.22, 0.05, 0.004, -0.003, 0.01)
PINCUSHION = gs.BrownDistortion(0.18)
FISHEYE = gs.FisheyeDistortion(-0.02, 0.004)
LENSES = (BARREL, PINCUSHION, FISHEYE)
SIDE = 0.5  # of a square of the board, in the plane z = 0
HALF = 12  # squares from the middle to an edge


def pixels_of(points: np.ndarray, lens: gs.Distortion) -> np.ndarray:
    """cv2.projectPoints with distortion: pixel (0, 0) is a centre."""
    seen = points @ R.T + T
    plane = lens.distorted(seen[..., :2] / seen[..., 2:])
    return plane * (K[0, 0], K[1, 1]) + K[:2, 2]


def board() -> gs.Scene:
    """A checkerboard; each square is a node, so that `node` says where the corners are."""
    nodes = []
    for j in range(-HALF, HALF):
        for i in range(-HALF, HALF):
            x, y = np.array([i, i + 1, i + 1, i]) * SIDE, np.array([j, j, j + 1, j + 1]) * SIDE
            color = (0.9, 0.9, 0.9, 1.0) if (i + j) % 2 else (0.1, 0.1, 0.1, 1.0)
            mesh = gs.Mesh(
                np.stack([x, y, np.zeros(4)], axis=1), [[0, 1, 2], [0, 2, 3]], material=gs.Material(color=color)
            )
            nodes.append(gs.Node(mesh, name=f"{i},{j}"))
    return gs.Scene(tuple(nodes))


SCENE = board()
LIGHT = [gs.DirectionalLight(direction=(0.0, 0.0, -1.0), shadow=None)]


def rendered(lens: gs.Distortion, outputs: object, **options: object) -> gs.Frame:
    return gs.render_distorted(SCENE, CAMERA, lens, LIGHT, SIZE, outputs=outputs, samples=1, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("lens", LENSES, ids=("barrel", "pincushion", "fisheye"))
@pytest.mark.parametrize("oversampling", [1, 2, 3])
def test_a_pixels_surface_point_is_within_the_stated_error(lens: gs.Distortion, oversampling: int) -> None:
    """The world point that a pixel shows, imaged by the lens, lies at most sqrt(.5) / oversampling pixels from the pixel's centre."""
    frame = rendered(lens, ("position", "node", "depth"), oversampling=oversampling)
    seen = frame.node >= 0
    assert seen.mean() > 0.9
    centres = np.stack(np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1])), axis=-1)
    away = np.linalg.norm(pixels_of(frame.position, lens) - centres, axis=-1)[seen]
    assert away.max() <= np.sqrt(0.5) / oversampling + 0.01  # curvature of the lens within a pixel
    assert away.max() > 0.5 * np.sqrt(0.5) / oversampling  # the bound is not idle
    np.testing.assert_allclose(frame.depth[seen], 3.0, rtol=1e-5)
    # exact values, not blends: the point's own square
    square = np.floor(frame.position[seen][:, :2] / SIDE).astype(int) + HALF
    inner = np.abs(frame.position[seen][:, :2] / SIDE - np.rint(frame.position[seen][:, :2] / SIDE)).min(axis=1) > 1e-6
    np.testing.assert_array_equal(frame.node[seen][inner], (square[:, 0] + 2 * HALF * square[:, 1])[inner])


@pytest.mark.parametrize("lens", LENSES, ids=("barrel", "pincushion", "fisheye"))
def test_corners_of_a_checkerboard(lens: gs.Distortion) -> None:
    """Where four squares meet in the node image, the forward model puts their corner: half a pixel of the grid, and the stated error."""
    node = rendered(lens, "node").node
    blocks = np.stack([node[:-1, :-1], node[:-1, 1:], node[1:, :-1], node[1:, 1:]], axis=-1)
    found = 0
    for j in range(1 - HALF, HALF):
        for i in range(1 - HALF, HALF):
            u, v = pixels_of(np.array([i * SIDE, j * SIDE, 0.0]), lens)
            if not (3 < u < SIZE[0] - 4 and 3 < v < SIZE[1] - 4):
                continue
            found += 1
            around = [(i - a + HALF) + 2 * HALF * (j - b + HALF) for a in (0, 1) for b in (0, 1)]
            meet = np.argwhere(
                (np.isin(blocks, around)).all(axis=-1) & (np.diff(np.sort(blocks, axis=-1)) > 0).all(axis=-1)
            )
            if not len(meet):  # the rows and columns may change at different pixels
                meet = np.argwhere(
                    (np.isin(blocks, around)).all(axis=-1) & ((np.diff(np.sort(blocks, axis=-1)) > 0).sum(axis=-1) == 2)
                )
            assert len(meet), (i, j)
            off = np.abs(meet[:, ::-1] + 0.5 - (u, v)).max(axis=1).min()
            assert off <= 0.5 + np.sqrt(0.5) / 2 + 0.01, (i, j, off)
    assert found >= 30


def test_edges_of_the_image_have_subpixel_positions() -> None:
    """Along a row, the light sum says where the edge between two squares is; oversampling 4: an eighth of a pixel at most."""
    frame = rendered(BARREL, "linear", oversampling=4)
    dark, light = np.unique(np.round(frame.linear[..., 0], 3))[[0, -1]]
    share = (frame.linear[..., 0] - dark) / (light - dark)
    checked = 0
    for row in range(20, 220, 10):
        for i in range(-3, 4):
            # the edge x = i SIDE where it crosses the centre line of this row, by bisection in y
            low, high = -3.0, 3.0
            for _ in range(60):
                middle = 0.5 * (low + high)
                low, high = (
                    (middle, high) if pixels_of(np.array([i * SIDE, middle, 0.0]), BARREL)[1] > row else (low, middle)
                )
            u = pixels_of(np.array([i * SIDE, low, 0.0]), BARREL)[0]
            near_corner = abs(low / SIDE - round(low / SIDE)) < 0.15
            start = round(u) - 3
            if near_corner or not 3 < u < SIZE[0] - 5:
                continue
            part = share[row, start : start + 7]
            rises = part[-1] > part[0]
            edge = start - 0.5 + (7 - part.sum() if rises else part.sum())
            assert abs(edge - u) < 0.125, (row, i, edge, u)
            checked += 1
    assert checked > 50


def test_no_distortion_is_the_plain_image() -> None:
    """At oversampling 1 the wide image has the pixels of an image with square pixels."""
    scene = gs.scenes.box().scene
    names = ("image", "linear", "visibility", "depth", "node", "normal", "alpha")
    for camera in (
        scene.camera,
        gs.IntrinsicsCamera(300.0, 300.0, 150.2, 117.9, scene.camera.position, scene.camera.target),
    ):
        plain = gs.render(scene, camera, size=SIZE, outputs=names, samples=4, exposure=1.0)
        frame = gs.render_distorted(
            scene, camera, gs.BrownDistortion(), size=SIZE, oversampling=1, outputs=names, samples=4, exposure=1.0
        )
        assert frame.camera == camera
        assert frame.size == SIZE
        same = frame.node == plain.node
        assert same.mean() > 0.9995  # pixels on an edge, by rounding
        # 1 of 255: rounding of the mean in linear light
        assert (np.abs(frame.image.astype(int) - plain.image).max(axis=-1) <= 1).mean() > 0.998
        np.testing.assert_allclose(frame.depth[same], plain.depth[same], rtol=1e-4)
        assert (np.isnan(frame.visibility) == np.isnan(plain.visibility)).mean() > 0.999


def test_transparent_background_and_a_given_renderer() -> None:
    scene = gs.scenes.box().scene
    with gs.Renderer() as renderer:
        frame = gs.render_distorted(
            scene, None, BARREL, size=(64, 48), renderer=renderer, outputs="all", background=None, samples=4
        )
    assert frame.image.shape == (48, 64, 4)
    assert frame.linear.shape == (48, 64, 4)
    assert frame.visibility.shape == (1, 48, 64)
    assert frame.position.shape == (48, 64, 3)
    assert (frame.image[..., 3] == np.rint(255 * frame.alpha)).all()
    assert frame.timings


def test_a_frame_depends_on_its_arguments_alone() -> None:
    first = rendered(BARREL, ("image", "node"))
    rendered(PINCUSHION, ("image", "node"))
    again = rendered(BARREL, ("image", "node"))
    np.testing.assert_array_equal(first.image, again.image)
    np.testing.assert_array_equal(first.node, again.node)


LONG = gs.IntrinsicsCamera(1000.0, 1000.0, 1550.0, 100.0)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"distortion": gs.FisheyeDistortion(), "camera": gs.IntrinsicsCamera(100.0, 100.0, 160.0, 120.0)}, "90 degrees"),
        ({"distortion": gs.BrownDistortion(-0.9)}, "more than one direction"),
        ({"distortion": gs.FisheyeDistortion(), "size": (3100, 200), "camera": LONG}, "wide image"),
        ({"camera": gs.OrthographicCamera()}, "parallel"),
        ({"distortion": (0.1, 0.0, 0.0, 0.0, 0.0)}, "distortion must be"),
        ({"oversampling": 0}, "oversampling"),
        ({"outputs": "colour"}, "outputs"),
        ({"renderer": "mine"}, "renderer"),
    ],
)  # fmt: skip
def test_what_cannot_be_rendered_is_refused(arguments: dict[str, object], named: str) -> None:
    given = {"scene": SCENE, "camera": CAMERA, "distortion": BARREL, "size": SIZE, **arguments}
    with pytest.raises(SettingsError, match=named):
        gs.render_distorted(**given)  # type: ignore[arg-type]


@pytest.mark.parametrize("lens", [BARREL, FISHEYE], ids=("barrel", "fisheye"))
def test_arrays_have_the_lens(tmp_path: Path, lens: gs.Distortion) -> None:
    """K, R, t and D of the file image each position within the stated error of its pixel."""
    frame = gs.render_distorted(
        SCENE, CAMERA, lens, LIGHT, (64, 48), tmp_path / "a.npz", outputs=("position",), samples=1
    )
    assert frame.distortion == lens
    with np.load(tmp_path / "a.npz") as file:
        K, R, t, D, position = (file[name] for name in ("K", "R", "t", "D", "position"))
    again = (gs.BrownDistortion if len(D) == 5 else gs.FisheyeDistortion)(*D)
    seen = position @ R.T + t
    pixel = again.distorted(seen[..., :2] / seen[..., 2:]) * (K[0, 0], K[1, 1]) + K[:2, 2]
    away = np.linalg.norm(pixel - np.stack(np.meshgrid(np.arange(64), np.arange(48)), axis=-1), axis=-1)
    assert np.nanmax(away) <= np.sqrt(0.5) / 2 + 1e-6  # float32 depths
    gs.render(SCENE, CAMERA, LIGHT, (64, 48), tmp_path / "b.npz", outputs=("node",), samples=1)
    assert "D" not in np.load(tmp_path / "b.npz")
