"""A scene's bounding box: corners, validity, the default camera that frames it, and the default light."""

from __future__ import annotations

import numpy as np

from glshadow.core.cameras import PerspectiveCamera
from glshadow.core.spaces import FARTHEST, Array, view_axes
from glshadow.errors import SceneError
from glshadow.lights import DirectionalLight

# direction from the scene to the default camera: three-quarter view from above, chosen by eye
VIEW_DIRECTION = (0.55, 0.45, 0.70)
VIEW_MARGIN = 1.1  # margin of the image around the box, so that nothing touches its border
SUN_DIRECTION = (-0.55, -0.8, -0.25)  # as in the courtyard: 53 degrees high, shadows fall to the left and away
SUN_INTENSITY = 0.8


def box_corners(bounds: Array, world_from_mesh: Array) -> Array:
    """World corners (N, 8, 3) of boxes (N, 2, 3) with matrices (N, 4, 4)."""
    picks = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    local = np.stack([bounds[:, picks[:, axis], axis] for axis in range(3)], axis=-1)
    with np.errstate(over="ignore", invalid="ignore"):  # see check_place
        return np.asarray(
            np.einsum("nij,nkj->nki", world_from_mesh[:, :3, :3], local) + world_from_mesh[:, None, :3, 3]
        )


def check_place(corners: Array, whose: str = "") -> None:
    """Check world corners (..., 3): they must not overflow or be too far from the origin to be drawn.

    Raises
    ------
    SceneError
        If they do; the message begins with `whose`.
    """
    if not np.isfinite(corners).all():
        raise SceneError(f"{whose}its world coordinates overflow: check the matrices of its nodes")
    far = float(np.abs(corners).max())
    if far > 0.1 * FARTHEST:  # the default camera must fit outside
        raise SceneError(f"{whose}it is {far:.3g} from the origin; the limit is {0.1 * FARTHEST:g}: move it first")


def default_camera(bounds: Array) -> PerspectiveCamera:
    """Camera that frames a box (2, 3): it looks along -VIEW_DIRECTION at the middle with a field of view of 50 degrees, as near as
    possible with all corners inside a square image. A wider image shows more at the sides."""
    centre = 0.5 * (bounds[0] + bounds[1])
    towards = np.asarray(VIEW_DIRECTION) / np.linalg.norm(VIEW_DIRECTION)
    corners = box_corners(bounds[None], np.eye(4)[None])[0] - centre
    x, y, z = view_axes(-towards) @ corners.T
    # a corner at distance d - z is visible if |x|, |y| <= tangent (d - z)
    tangent = np.tan(np.radians(25.0)) / VIEW_MARGIN
    eye = centre + towards * float((z + np.maximum(np.abs(x), np.abs(y)) / tangent).max())
    return PerspectiveCamera(tuple(eye), tuple(centre))


def default_sun() -> DirectionalLight:
    """One white directional light along SUN_DIRECTION; with the ambient light level white reaches 0.91, white that faces both 1.06."""
    return DirectionalLight(direction=SUN_DIRECTION, intensity=SUN_INTENSITY)
