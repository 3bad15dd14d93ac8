"""Points that receive light, in place of a camera's pixels: textures with a texel for each, and a view without a camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import moderngl
import numpy as np
from numpy.typing import NDArray

from glshadow.core.cameras import OrthographicCamera
from glshadow.core.spaces import Array, ClipSpace
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.targets import CameraTargets, released_on_error
from glshadow.gl.passes.camera import CameraView
from glshadow.gl.scene.geometry import GpuScene
from glshadow.shadows.view import camera_view

ROW = 2048
"""Points in a row of the textures."""


class PointTargets(CameraTargets):
    """Textures of points, as many as fill some rows; takes the place of a camera's targets in passes that compute visibility.

    Attributes
    ----------
    surface : moderngl.Texture
        Each point's triangle, as in the surface buffer.
    seen, located : moderngl.Framebuffer
        To write one light's visibility, and the triangles.
    """

    def __init__(self, context: GLContext, count: int, normals: bool) -> None:
        self.size, self.samples, self.block = (min(count, ROW), -(-count // ROW)), 1, (1, 1)
        context.check_size(self.size, "points")
        ctx = context.ctx
        made: list[Any] = []

        def texture(components: int, dtype: str) -> moderngl.Texture:
            made.append(ctx.texture(self.size, components, dtype=dtype))
            made[-1].filter = (moderngl.NEAREST, moderngl.NEAREST)
            kept: moderngl.Texture = made[-1]
            return kept

        with released_on_error(made):
            self.surface = texture(1, "u4")
            self.given = {"u_places": texture(4, "f4")} | ({"u_normals": texture(4, "f4")} if normals else {})
            self._seen = texture(1, "f4")
            context.check_errors(f"allocating {count} points")
            self.seen = ctx.framebuffer([self._seen])
            made.append(self.seen)
            self.located = ctx.framebuffer([self.surface])
            made.append(self.located)
        self.points = 2 if normals else 1
        self.depth = self.emission = self.mixed = None  # type: ignore[assignment]  # passes without a depth attachment draw everywhere
        self.fine = self  # type: ignore[assignment]  # one sample for each
        self._made = made[::-1]
        self.renew()

    def write(
        self,
        places: NDArray[np.float32],
        surface: NDArray[np.uint32] | None,
        normals: NDArray[np.float32] | None,
    ) -> None:
        """Upload points (W * H, 4) as lib/given_point.glsl has them, their triangles (W * H,) and normals (W * H, 4)."""
        self.given["u_places"].write(places)
        if surface is not None:
            self.surface.write(surface)
        if normals is not None:
            self.given["u_normals"].write(normals)
        self.renew()

    def read_triangles(self) -> NDArray[np.uint32]:
        """The triangles (W * H,)."""
        return np.frombuffer(self.surface.read(), dtype=np.uint32)

    def read_places(self) -> NDArray[np.float32]:
        """The points (W * H, 4), to be changed."""
        return np.frombuffer(self.given["u_places"].read(), dtype=np.float32).reshape(-1, 4).copy()

    def read(self, count: int) -> NDArray[np.float32]:
        """The visibility (count,) of the first points."""
        return np.frombuffer(self._seen.read(), dtype=np.float32)[:count]

    def release(self) -> None:
        """Free the GPU memory."""
        for each in self._made:
            each.release()


@dataclass(frozen=True, eq=False)
class PointView(CameraView):
    """In place of a camera's view: receivers may be anywhere, and their rounding is that of the scene's triangles."""

    @classmethod
    def of(cls, scene: GpuScene, size: tuple[int, int]) -> PointView:
        """For a texture of points of this size."""
        place = scene.origin
        camera = OrthographicCamera(
            position=tuple(place.tolist()), target=tuple((place - place_of_unit(place)).tolist())
        )
        clip, count = ClipSpace(False, False), len(scene.nodes)
        view = camera_view(camera, size, 0.0, 1.0, clip)
        return cls(
            camera, size, 0.0, 1.0, clip, view, scene.boxes, scene.lifts, np.zeros(0, dtype=np.int64),
            np.zeros((0, 4, 4), dtype=np.float32), np.zeros(count, dtype=bool),
        )  # fmt: skip

    anywhere: ClassVar[bool] = True

    @property
    def start_distance(self) -> float:
        """No ray leads to a point."""
        return 0.0


def place_of_unit(place: Array) -> Array:
    """A vector along z that changes a point (3,) in float64."""
    return np.array([0.0, 0.0, max(1.0, float(np.abs(place).max()))])
