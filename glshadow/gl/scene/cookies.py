"""Textures of lights, kept as long as their Cookie or LightTable is alive."""

from __future__ import annotations

import weakref

import moderngl

from glshadow.gl.driver.context import GLContext
from glshadow.gl.scene.textures import color_texture
from glshadow.lights.table import LightTable
from glshadow.shadows.cookie import Cookie


class Cookies:
    """A context's textures of lights: linear light, filtered, with the border mode of the cookie or table."""

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._held: weakref.WeakKeyDictionary[Cookie | LightTable, moderngl.Texture] = weakref.WeakKeyDictionary()
        self._made: list[moderngl.Texture] = []

    def get(self, cookie: Cookie) -> moderngl.Texture:
        """The cookie's texture, uploaded at its first use."""
        texture = self._held.get(cookie)
        if texture is None:
            texture = color_texture(self._context, cookie.image, "a light's cookie")
            self._made.append(texture)
            texture.filter = (
                moderngl.LINEAR,
                moderngl.LINEAR,
            )  # shading from a list of pixels has no derivatives for choosing a mip level
            texture.repeat_x = texture.repeat_y = cookie.repeat
            self._held[cookie] = texture
        return texture

    def get_table(self, table: LightTable) -> moderngl.Texture:
        """A table's texture, uploaded at its first use."""
        texture = self._held.get(table)
        if texture is None:
            height, width = table.texels.shape[:2]
            self._context.check_size((width, height), "a light's table")
            texture = self._context.ctx.texture((width, height), 3, table.texels.tobytes(), dtype="f4")
            self._made.append(texture)
            texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
            texture.repeat_x, texture.repeat_y = table.repeat, False
            self._held[table] = texture
        return texture

    def sweep(self) -> None:
        """Release the textures of cookies and tables that were garbage-collected."""
        held = set(map(id, self._held.values()))
        for texture in [each for each in self._made if id(each) not in held]:
            self._made.remove(texture)
            texture.release()

    def release(self) -> None:
        """Release all textures."""
        self._held.clear()
        self.sweep()
