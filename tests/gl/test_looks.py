"""Images of the looks: the ground of the studio is its background, and white is neither clipped nor dark."""

from __future__ import annotations

import numpy as np

import glshadow as gs

CUBE = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
FACES = np.reshape(
    [0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3],
    (12, 3),
)


def cube() -> gs.Mesh:
    return gs.Mesh(CUBE, FACES)


def test_ground_of_the_studio_is_the_background(renderer: gs.Renderer) -> None:
    scene = gs.load(cube(), ground=True)
    for background in ((0.94, 0.94, 0.94), (0.2, 0.3, 0.4)):
        given = {} if background[0] == 0.94 else {"background": background}
        frame = renderer.render(scene, size=(96, 54), samples=1, outputs=("image", "node", "visibility"), **given)  # type: ignore[arg-type]
        ground = (frame.node == 1) & (frame.visibility[0] == 1)
        expected = np.rint(255 * np.array(background))
        # of the sky a share is hidden by the model everywhere; what is left of its light is a third of all at most
        darker = expected.max() - frame.image[ground].max(axis=-1).astype(int)
        hidden = 1 - frame.visibility[1][ground]
        assert (darker >= 0).all()
        assert (darker <= 1 + 255 * hidden).all()
        assert (frame.image[frame.node < 0] == expected).all()
        assert (darker <= 2).sum() > 200
        shaded = (frame.node == 1) & (frame.visibility[0] == 0)
        assert (frame.image[shaded].max(axis=-1) < expected.max() - 20).all()
        # beside the model, not behind it: the shadow's middle is at the model's height
        rows, columns = np.nonzero(shaded)
        model = np.nonzero(frame.node == 0)
        assert columns.mean() > model[1].max() - 5
        assert rows.mean() > model[0].mean()


def test_plain_and_outdoor_have_a_plane_of_their_own(renderer: gs.Renderer) -> None:
    for look in ("plain", "outdoor"):
        scene = gs.load(cube(), ground=True, look=look)
        assert not scene.nodes[1].catches
        assert (renderer.render(scene, size=(48, 27), samples=1, outputs="alpha").alpha[-1] == 1).all()
    assert gs.load(cube(), ground="catcher", look="outdoor").nodes[1].catches


def test_white_is_neither_clipped_nor_dark(renderer: gs.Renderer) -> None:
    """The bounds of the look, on a ball, which has every normal: of the display's white, as encoded."""
    turns = np.linspace(0, 2 * np.pi, 33)
    heights = np.linspace(0, np.pi, 17)
    rows = [[np.sin(h) * np.cos(t), np.cos(h), np.sin(h) * np.sin(t)] for h in heights for t in turns]
    faces = [[i, i + 1, i + 34] for i in range(33 * 16 - 1)] + [[i, i + 34, i + 33] for i in range(33 * 16 - 1)]
    white = gs.Material(color=(0.8, 0.8, 0.8, 1), double_sided=True)  # what a file's meshes without a material have
    ball = gs.Mesh(np.array(rows), np.array(faces), normals=np.array(rows, np.float32), material=white)
    scene = gs.load(ball, ground=True)
    frame = renderer.render(scene, size=(96, 54), samples=1, outputs=("image", "node", "visibility"))
    levels = frame.image[frame.node == 0].max(axis=-1) / 255
    assert levels.max() < 1
    assert 0.55 < np.median(levels) < 0.85
    assert frame.image[(frame.node == 0) & (frame.visibility[0] > 0.9)].min() / 255 > 0.15
