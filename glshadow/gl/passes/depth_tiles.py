"""Depth range of the visible surfaces, tile by tile of the camera's depth buffer."""

from __future__ import annotations

import moderngl
import numpy as np

from glshadow.gl.driver.targets import release
from glshadow.gl.frame_context import FrameContext
from glshadow.gl.passes.readback import pixels
from glshadow.shadows.fit_request import DepthTiles

SIDE = 16
"""Pixels, or samples, along each side of a tile."""
_SLACK = 1e-5
"""Relative depth error of a shaded surface point against the drawn depth: GL interpolates between snapped vertices."""


def find_depth_tiles(frame: FrameContext) -> DepthTiles:
    """Find the tiles that show a surface. Reads a few kB back, and so waits for the GPU."""
    camera_view, depth = frame.camera_view, frame.targets.fine.depth
    size = (-(-depth.size[0] // SIDE), -(-depth.size[1] // SIDE))
    ctx = frame.context.ctx
    bounds = ctx.texture(size, 2, dtype="f4")
    framebuffer = ctx.framebuffer([bounds])
    ctx.enable_only(moderngl.NOTHING)
    program = frame.programs.get("pass/over.vert", "pass/depth_tiles.frag", defines={"GLS_SIDE": SIDE})
    program.set(u_nothing=camera_view.clip.clear_depth)
    program.bind(u_depth=(depth, frame.samplers.plain))
    framebuffer.use()
    program.vertex_array().render(moderngl.TRIANGLES, vertices=3)
    program.unbind()
    found = pixels(bounds, np.float32)[::-1].astype(np.float64)
    frame.targets.depth_framebuffer.use()
    release(framebuffer, bounds)
    seen = found[..., 0] <= found[..., 1]
    ends = np.sort(camera_view.depth(found[seen]), axis=-1)
    rows, columns = np.nonzero(seen)
    # corners in NDC, one pixel wider: a shaded point may lie a fraction of a pixel beside its pixel
    pixel = np.array(
        [[columns, rows], [columns + 1, rows], [columns, rows + 1], [columns + 1, rows + 1]], dtype=np.float64
    )
    pixel = SIDE * pixel + np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]])[:, :, None]
    ndc = 2.0 * pixel / np.array(depth.size)[:, None] - 1.0
    local = np.einsum(
        "ij,cjb->bci", camera_view.rays, np.stack([ndc[:, 0], ndc[:, 1], np.ones(ndc[:, 0].shape)], axis=1)
    )
    axes, eye = camera_view.camera.view_from_world[:3, :3], np.asarray(camera_view.camera.position)
    world = local @ axes
    if camera_view.camera.is_perspective:
        starts, rays = np.broadcast_to(eye, world.shape), world
    else:
        starts, rays = eye + world, np.broadcast_to(-axes[2], world.shape)
    return DepthTiles(starts, rays, ends[:, 0] * (1.0 - _SLACK), ends[:, 1] * (1.0 + _SLACK))
