"""Cookies as textures, each as long as somebody holds it."""

from __future__ import annotations

import weakref

import moderngl

from glshadow.gl.driver.context import GLContext
from glshadow.gl.scene.meshes import color_texture
from glshadow.shadows.cookie import Cookie


class Cookies:
    """The cookies' textures of a context: linear light, filtered, their borders as the cookie wants them."""

    def __init__(self, context: GLContext) -> None:
        self._context = context
        self._held: weakref.WeakKeyDictionary[Cookie, moderngl.Texture] = weakref.WeakKeyDictionary()
        self._made: list[moderngl.Texture] = []

    def get(self, cookie: Cookie) -> moderngl.Texture:
        """Its texture, uploaded the first time."""
        texture = self._held.get(cookie)
        if texture is None:
            texture = color_texture(self._context, cookie.image, "a light's cookie")
            self._made.append(texture)
            texture.filter = (
                moderngl.LINEAR,
                moderngl.LINEAR,
            )  # a buffer of pixels has no derivatives to choose a level by
            texture.repeat_x = texture.repeat_y = cookie.repeat
            self._held[cookie] = texture
        return texture

    def sweep(self) -> None:
        """Free those of cookies that are gone."""
        held = set(map(id, self._held.values()))
        for texture in [each for each in self._made if id(each) not in held]:
            self._made.remove(texture)
            texture.release()

    def release(self) -> None:
        """Free them all."""
        self._held.clear()
        self.sweep()
