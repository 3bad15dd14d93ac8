"""view: a window to turn, light and check a scene."""

from __future__ import annotations

import os
import sys
import textwrap
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshadow.arguments import DEFAULT_SIZE, as_scene, pixels
from glshadow.core.cameras import Camera
from glshadow.errors import ContextError, GlshadowError, SettingsError
from glshadow.gl.driver.present import Presenter, window_context
from glshadow.lights import Lights
from glshadow.ui.controls import HELP, Controls, landscapes
from glshadow.ui.showing import Showing
from glshadow.ui.viewer import TRACING, View, Viewer

REST = 0.25  # seconds without a change, after which the image is drawn in full
SMOOTH_MS = 40.0  # an image that takes no longer is drawn in full even while things move
SAID = 4.0  # seconds for which a message stays visible
TITLE = "glshadow"
NO_SCREEN = "a window needs a screen, and no screen is available{}; `glshadow render` writes the same image to a file"


class Window:
    """A window on the screen.

    Parameters
    ----------
    showing : Showing
    open : callable
        Returns the state for a dropped file.
    size : (2,) ints
    folder : Path
        Folder for screenshots.

    Raises
    ------
    ContextError, SettingsError
        As for `show`.
    """

    def __init__(
        self,
        showing: Showing,
        open: Callable[[Path], Showing],
        size: tuple[int, int] = DEFAULT_SIZE,
        folder: Path | None = None,
    ) -> None:
        self.controls = Controls(showing, landscapes())
        self._open, self._folder = open, folder or Path.cwd()
        self._glfw = glfw = _glfw()
        self._window = _opened(glfw, size)
        self._viewer = Viewer(context=window_context())
        self._presenter = Presenter(self._viewer.renderer._context.ctx)
        self._pointer = (0.0, 0.0)
        self._held: int | None = None  # mouse button
        self._changed, self._said_at, self._moved_at = True, time.monotonic(), 0.0
        self._whole = self._halved = self._worded = (
            False  # state of the screen: drawn at rest, drawn small, with a message
        )
        self.view: View | None = None
        self._error = ""
        glfw.set_key_callback(self._window, self._key)
        glfw.set_char_callback(self._window, self._character)
        glfw.set_cursor_pos_callback(self._window, self._cursor)
        glfw.set_mouse_button_callback(self._window, self._button)
        glfw.set_scroll_callback(self._window, self._scroll)
        glfw.set_drop_callback(self._window, self._dropped)
        glfw.set_framebuffer_size_callback(self._window, lambda *_: self._change())
        glfw.set_window_refresh_callback(self._window, lambda *_: self._change())

    def run(self) -> None:
        """Run until the window is closed."""
        glfw, last = self._glfw, time.monotonic()
        try:
            while not glfw.window_should_close(self._window):
                animated = self.controls.animated
                glfw.wait_events_timeout(0.005 if animated else 0.05)
                now = time.monotonic()
                if animated:
                    self.controls.advanced(now - last)
                    self._change()
                last = now
                self._show(now)
        finally:
            self.close()

    def close(self) -> None:
        """Release everything; may be called twice."""
        if self._window is None:
            return
        self._presenter.release()
        self._viewer.release()
        self._glfw.destroy_window(self._window)
        self._glfw.terminate()
        self._window = None

    # -- drawing

    def _show(self, now: float) -> None:
        resting = now - self._moved_at >= REST and self._held is None and not self.controls.animated
        words = now - self._said_at < SAID
        if not self._changed and (self._whole or not resting) and words == self._worded:
            return
        size = tuple(max(n, 16) for n in self._glfw.get_framebuffer_size(self._window))
        if self._changed or not self._whole or self.view is None:
            fast = self.view is not None and self.view.ms <= SMOOTH_MS and not self._halved
            moving = not resting and not fast
            self._draw((size[0], size[1]), moving, resting)
        self._changed, self._worded = False, words
        if self.view is not None:
            self._present(self._with_words(self.view, words), (size[0], size[1]))

    def _present(self, picture: NDArray[np.uint8], size: tuple[int, int]) -> None:
        self._presenter.show(picture, size)
        self._glfw.swap_buffers(self._window)

    def _draw(self, size: tuple[int, int], moving: bool, resting: bool) -> None:
        showing = self.controls.showing
        if not resting:  # tracing takes seconds: measure only at rest
            showing = replace(showing, error=False)
        elif showing.error and self.view is not None:
            self._present(written(self.view.image, [TRACING]), size)
        try:
            self.view = self._viewer.draw(showing, size, moving)
            self._error, self._halved = "", moving
        except GlshadowError as error:  # settings that cannot be combined: show the message, keep the last image
            self._error = str(error)
        self._whole = resting

    def _with_words(self, view: View, words: bool) -> NDArray[np.uint8]:
        lines = [self._error or view.facts]
        if words and self.controls.said:
            lines.insert(0, self.controls.said)
        return written(view.image, lines, HELP if self.controls.helped else ())

    # -- events

    def _change(self) -> None:
        self._changed, self._whole = True, False

    def _move(self) -> None:
        self._moved_at = time.monotonic()
        self._change()

    def _press(self, key: str) -> None:
        try:
            known = self.controls.pressed(key)
        except GlshadowError as error:
            self.controls.said, known = str(error), True
        if known:
            self._said_at = time.monotonic()
            self._move() if key in ("up", "down", "left", "right") else self._change()

    def _key(self, _window: Any, key: int, _code: int, action: int, _mods: int) -> None:
        glfw = self._glfw
        if action not in (glfw.PRESS, glfw.REPEAT):
            return
        named = {
            glfw.KEY_UP: "up",
            glfw.KEY_DOWN: "down",
            glfw.KEY_LEFT: "left",
            glfw.KEY_RIGHT: "right",
            glfw.KEY_SPACE: "space",
        }
        if key == glfw.KEY_ESCAPE:
            glfw.set_window_should_close(self._window, True)
        elif key in named:
            self._press(named[key])

    def _character(self, _window: Any, code: int) -> None:
        letter = chr(code)
        if letter == "q":
            self._glfw.set_window_should_close(self._window, True)
        elif letter == "c":
            self._screenshot()
        elif letter != " ":
            self._press("+" if letter == "=" else letter)

    def _cursor(self, window: Any, x: float, y: float) -> None:
        glfw, last = self._glfw, self._pointer
        self._pointer = (x, y)  # querying the system would give the current position, not that of this event
        if self._held is None:
            return
        height = float(glfw.get_window_size(window)[1])
        shifted = glfw.get_key(window, glfw.KEY_LEFT_SHIFT) == glfw.PRESS
        pan = shifted or self._held == glfw.MOUSE_BUTTON_RIGHT
        self.controls.dragged((x - last[0]) / height, (y - last[1]) / height, pan)
        self._move()

    def _button(self, _window: Any, button: int, action: int, _mods: int) -> None:
        self._held = button if action == self._glfw.PRESS else None
        self._change()

    def _scroll(self, _window: Any, _right: float, steps: float) -> None:
        self.controls.scrolled(steps)
        self._move()

    def _dropped(self, _window: Any, paths: Sequence[str]) -> None:
        try:
            self.controls.opened(self._open(Path(paths[0])))
        except GlshadowError as error:  # the last scene stays
            self.controls.said = str(error)
        self._said_at = time.monotonic()
        self._change()

    def _screenshot(self) -> None:
        from glshadow import image

        if self.view is None:
            return
        number = 1
        while (path := self._folder / f"glshadow_{number:03d}.png").exists():
            number += 1
        image.write(path, self.view.image)
        self.controls.said = f"saved {path.name}"
        self._said_at = time.monotonic()
        self._change()


def show(scene: Any, camera: Camera | None = None, lights: Lights = None, size: tuple[int, int] = DEFAULT_SIZE) -> None:
    """Open a window in which a scene can be turned, lit and checked, until it is closed: the same as `glshadow view`.

    Parameters
    ----------
    scene : Scene, or anything that `load` takes
    camera, lights
        As for `Renderer.render`.
    size : (2,) ints
        Size of the window, pixels.

    Raises
    ------
    ContextError
        If there is no screen, or no OpenGL 3.3 on it.
    SettingsError
        If glfw is not installed; the message says how to install it.

    Notes
    -----
    The key h shows all keys. Drag turns, right drag pans, the wheel zooms; dropping a file opens it.
    """
    showing = Showing.of(as_scene(scene, usual="plain"), camera, lights)
    Window(showing, lambda path: Showing.of(as_scene(path, usual="plain")), pixels("size", size)).run()


def written(
    picture: NDArray[np.uint8], lines: Sequence[str], table: Sequence[tuple[str, str]] = ()
) -> NDArray[np.uint8]:
    """An image with lines of text in its lower left corner, and a table of keys in its upper left."""
    from PIL import Image, ImageDraw, ImageFont

    sheet = Image.fromarray(picture)
    pen = ImageDraw.Draw(sheet, "RGBA")
    side = max(12, min(16, picture.shape[0] // 36))
    font = ImageFont.load_default(size=side)
    step = side + 5
    letters = max(1, int((picture.shape[1] - 28) / pen.textlength("n", font=font)))
    lines = [part for line in lines for part in textwrap.wrap(line, letters)]
    top = picture.shape[0] - step * len(lines) - 6
    for number, line in enumerate(lines):
        width = pen.textlength(line, font=font)
        pen.rectangle((6, top + step * number, 14 + width, top + step * (number + 1) - 1), fill=(20, 24, 32, 170))
        pen.text((10, top + step * number + 1), line, fill=(255, 255, 255), font=font)
    if table:
        step = min(step, (picture.shape[0] - 20) // len(table))  # all of them fit, even in a small window
        font = ImageFont.load_default(size=max(step - 5, 7))
        across = max(pen.textlength(key, font=font) for key, _ in table) + 14
        wide = across + max(pen.textlength(text, font=font) for _, text in table) + 20
        pen.rectangle((6, 6, 6 + wide, 14 + step * len(table)), fill=(20, 24, 32, 200))
        for number, (key, text) in enumerate(table):
            pen.text((14, 10 + step * number), key, fill=(255, 208, 90), font=font)
            pen.text((14 + across, 10 + step * number), text, fill=(255, 255, 255), font=font)
    return np.asarray(sheet)


def _glfw() -> Any:
    try:
        import glfw
    except ImportError as error:
        raise SettingsError(f"a window needs glfw ({error}); install it with: pip install 'glshadow[view]'") from error
    return glfw


def _opened(glfw: Any, size: tuple[int, int]) -> Any:
    """A window whose context is current."""
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise ContextError(NO_SCREEN.format(" (DISPLAY and WAYLAND_DISPLAY are not set)"))
    glfw.ERROR_REPORTING = "ignore"
    if not glfw.init():
        raise ContextError(NO_SCREEN.format(f" ({_reason(glfw)})"))
    glfw.window_hint(glfw.CONTEXT_VERSION_MAJOR, 3)
    glfw.window_hint(glfw.CONTEXT_VERSION_MINOR, 3)
    glfw.window_hint(glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE)
    glfw.window_hint(glfw.OPENGL_FORWARD_COMPAT, True)
    window = glfw.create_window(*size, TITLE, None, None)
    if not window:
        reason = _reason(glfw)
        glfw.terminate()
        raise ContextError(f"no window with OpenGL 3.3 can be opened ({reason}); update the graphics driver")
    glfw.make_context_current(window)
    glfw.swap_interval(1)
    return window


def _reason(glfw: Any) -> str:
    code, words = glfw.get_error()
    text = words.decode(errors="replace") if isinstance(words, bytes) else words
    return text or f"glfw error {code}"
