"""LayerTargets: render targets for the blended layers of a part of the image, at every sample."""

from __future__ import annotations

from typing import Any

import moderngl

from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.targets import CameraTargets, SurfaceTargets, release, released_on_error


class LayerTargets:
    """Render targets of a part of the image.

    Attributes
    ----------
    opaque : CameraTargets
        The opaque surfaces behind the layers, and the light of whatever surface is shaded.
    layers : (2,) CameraTargets
        The layer that is drawn and the one before, in turn; they share the light with `opaque`.
    peeled : (2,) moderngl.Framebuffer
        To draw a layer: its surface, `kept`, its depth.
    kept : moderngl.Texture
        What the layer lets through, and its own share: see lib/peel.glsl.
    added, through : moderngl.Texture
        Sum of the layers' light, product of what they let through.
    adding, multiplying : (2,) moderngl.Framebuffer
        To draw to these for each of `layers`, against its depth.
    mean : moderngl.Texture
        Mean over the samples of each pixel, with its framebuffer `averaged`.
    """

    def __init__(
        self,
        context: GLContext,
        size: tuple[int, int],
        block: tuple[int, int],
        channels: int,
        lights: int,
        emits: bool = False,
    ) -> None:
        ctx = context.ctx
        self.size, self.block = size, block
        fine = (size[0] * block[0], size[1] * block[1])
        what = f"blended layers of {size[0]} x {size[1]} pixels"
        self._made: list[Any] = []

        def made(thing: Any) -> Any:
            self._made.append(thing)
            context.check_errors(f"allocating {what}")
            return thing

        def floats(size: tuple[int, int]) -> moderngl.Texture:
            texture: moderngl.Texture = made(ctx.texture(size, 4, dtype="f4"))
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            return texture

        with released_on_error(self._made):
            self.opaque: CameraTargets = made(CameraTargets(context, fine, 1, channels, lights, False, True, emits))
            self.layers = [self.opaque.showing(SurfaceTargets(context, fine, channels, what, emits)) for _ in range(2)]
            self._made += self.layers
            for each in (self.opaque, *self.layers):
                each.depth.compare_func = ""  # read without a sampler object
            self.kept, self.added, self.through = floats(fine), floats(fine), floats(fine)
            self.mean = floats(size)
            self.averaged = made(ctx.framebuffer([self.mean]))
            self.cleared = made(ctx.framebuffer([self.added, self.through]))
            self.peeled = []
            for each in self.layers:
                emission = [] if each.emission is None else [each.emission]
                self.peeled.append(made(ctx.framebuffer([each.surface, self.kept, *emission], each.depth)))
            self.adding = [made(self._reading(ctx, self.added, each)) for each in self.layers]
            self.multiplying = [made(self._reading(ctx, self.through, each)) for each in self.layers]

    @staticmethod
    def _reading(ctx: moderngl.Context, texture: moderngl.Texture, layer: CameraTargets) -> moderngl.Framebuffer:
        framebuffer = ctx.framebuffer([texture], layer.depth)
        framebuffer.depth_mask = False
        return framebuffer

    def release(self) -> None:
        """Free the GPU memory."""
        release(*reversed(self._made))
