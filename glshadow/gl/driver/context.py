"""One OpenGL context, created here or adopted: made current inside `with`; its capabilities, error checks and release."""

from __future__ import annotations

import os
import re
import threading
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal, Self, get_args

import moderngl

from glshadow.core.setting import one_of, optional, whole
from glshadow.errors import ContextError, GlshadowError, SettingsError
from glshadow.gl.driver.backends import LOADERS, Loader, make_context
from glshadow.gl.driver.current import Switch, address, current, make_current
from glshadow.gl.driver.entry_points import EntryPoints
from glshadow.gl.driver.queries import ANY_SAMPLES_PASSED, has_timestamps
from glshadow.gl.driver.state import default_state, preserved_state, write_state
from glshadow.signals import undisturbed

Backend = Literal["auto", "egl", "osmesa", "window"]

MIN_VERSION = 330
"""OpenGL 3.3 core, as moderngl counts versions: sampler objects, integer targets, buffer textures."""

DEVICE = re.compile(r"egl:\d{1,3}")
"""Matches a backend that names one of EGL's devices."""

_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software rasterizer", "swiftshader")


@dataclass(frozen=True)
class Caps:
    """Capabilities of a context, queried once.

    Attributes
    ----------
    backend
        "egl", "osmesa", "window", or "foreign" for an adopted context.
    version_code
        330 for OpenGL 3.3.
    max_texture_size, max_renderbuffer_size
        Pixels along one side.
    max_texture_buffer_size
        Elements of one buffer texture.
    doubles
        Whether shaders support double.
    max_storage_block
        Bytes of one storage buffer; 0 if there are none.
    clip_control
        Whether NDC depth can be 0..1.
    texture_gather
        Whether textureGather works on depth textures with comparison.
    compute
        Whether there are compute shaders with storage buffers and images: OpenGL 4.3.
    software
        Whether the driver renders on the CPU.
    timestamps
        Whether the GPU has timestamp queries.
    """

    backend: str
    renderer: str
    vendor: str
    version: str
    version_code: int
    max_texture_size: int
    max_renderbuffer_size: int
    max_texture_buffer_size: int
    max_viewport: tuple[int, int]
    max_color_attachments: int
    max_texture_units: int
    clip_control: bool
    texture_gather: bool
    depth_clamp: bool
    compute: bool
    doubles: bool
    max_storage_block: int
    software: bool
    timestamps: bool

    @classmethod
    def probe(cls, backend: str, ctx: moderngl.Context, gl: EntryPoints) -> Caps:
        """Query the current context; leaves no OpenGL error pending."""
        info, version, extensions = ctx.info, ctx.version_code, ctx.extensions
        renderer = str(info["GL_RENDERER"])
        software = any(name in renderer.lower() for name in _SOFTWARE)
        width, height = gl.integers(0x0D3A, 2)
        caps = cls(
            backend=backend,
            renderer=renderer,
            vendor=str(info["GL_VENDOR"]),
            version=str(info["GL_VERSION"]),
            version_code=version,
            max_texture_size=gl.integer(0x0D33),
            max_renderbuffer_size=gl.integer(0x84E8),
            max_texture_buffer_size=gl.integer(0x8C2B),
            max_viewport=(width, height),
            max_color_attachments=gl.integer(0x8CDF),
            max_texture_units=gl.integer(0x8872),
            clip_control=(version >= 450 or "GL_ARB_clip_control" in extensions) and gl.has("glClipControl"),
            texture_gather=version >= 400 or {"GL_ARB_texture_gather", "GL_ARB_gpu_shader5"} <= extensions,
            depth_clamp=version >= 320 or "GL_ARB_depth_clamp" in extensions,
            compute=version >= 430,
            doubles="GL_ARB_gpu_shader_fp64" in extensions,
            max_storage_block=gl.integer(0x90DE) if version >= 430 else 0,
            software=software,
            timestamps=not software and has_timestamps(gl),
        )
        gl.errors()
        return caps


_contexts: weakref.WeakSet[GLContext] = weakref.WeakSet()
_used_in: list[int] = []  # id of the process that first used OpenGL


def _after_fork() -> None:
    """Mark a forked child: the driver's threads do not exist there, and every OpenGL call would hang."""
    for context in _contexts:
        context.released = True
        context._end.detach()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)


class GLContext:
    """A moderngl context with the entry points that moderngl lacks; created by `open_context`.

    `with glcontext:` makes it current on this thread and restores the previous context afterwards. The blocks nest in any order, also
    with blocks of other contexts between. All OpenGL calls belong into such a block: object ids of two contexts collide, and an object
    of the wrong context is used without an error.

    One that is owned and dropped without `release` is destroyed by Python's garbage collector, on whatever thread that runs.

    Attributes
    ----------
    ctx : moderngl.Context
    gl : EntryPoints
    caps : Caps
    owned : bool
        Whether `release` destroys the context; false for an adopted one.
    """

    def __init__(self, ctx: moderngl.Context, backend: str, switch: Switch, owned: bool) -> None:
        self.ctx = ctx
        self.owned = owned
        self.released = False
        _contexts.add(self)
        _used_in[:] = [os.getpid()]
        self._switch = switch
        self._end = weakref.finalize(self, _destroy, ctx if owned else None, backend)
        self._end.atexit = False  # the driver frees all when the process ends
        with switch:
            self.gl = EntryPoints(_loader_of(ctx))
            self.caps = Caps.probe(backend, ctx, self.gl)
            self.trusts_timestamps = self.caps.timestamps  # until they prove wrong
            if owned:
                write_state(self.gl, default_state(ctx, self.gl))
                self.gl.check("setting the default state of a new context")

    @property
    def lost(self) -> bool:
        """Whether other code of the process has destroyed the context; nothing in it can be used or released any more."""
        return self._switch.lost

    def __enter__(self) -> Self:
        self._switch.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self._switch.__exit__()

    @contextmanager
    def drawing(self) -> Iterator[Self]:
        """Make it current, in the renderer's default state; the state of an adopted context is restored afterwards."""
        with self:
            if self.owned:
                yield self
            else:
                with preserved_state(self.ctx, self.gl):
                    yield self

    def recover(self) -> None:
        """After an interruption or an error: restore the default state, end open queries, drop pending errors."""
        self.gl.call("glEndQuery", ANY_SAMPLES_PASSED)
        write_state(self.gl, default_state(self.ctx, self.gl))
        self.gl.errors()

    def check_errors(self, what: str) -> None:
        """Raise if OpenGL reported an error since the last check; moderngl does not.

        Parameters
        ----------
        what
            The action for the message: "allocating the 4096 x 4096 shadow map".

        Raises
        ------
        ResourceError
            If the driver ran out of memory.
        GlshadowError
            On any other error.
        """
        self.gl.check(what)

    @property
    def largest_side(self) -> int:
        """Largest side of textures and framebuffers, in pixels."""
        return min(self.caps.max_texture_size, self.caps.max_renderbuffer_size, *self.caps.max_viewport)

    def check_size(self, size: tuple[int, int], what: str) -> None:
        """Raise if a texture or framebuffer is larger than the driver's limits.

        Raises
        ------
        SettingsError
            If a side is over the limit; the message names it.
        """
        width, height = size
        limit = self.largest_side
        if not (1 <= width <= limit and 1 <= height <= limit):
            raise SettingsError(
                f"{what} must be 1 to {limit} pixels wide and high on this driver ({self.caps.renderer}), "
                f"got {width} x {height}"
            )

    def release(self) -> None:
        """Destroy an owned context and everything in it; an adopted one is only released. May be called twice."""
        if self.released:
            return
        self.released = True
        self._end()


def _destroy(ctx: moderngl.Context | None, backend: str) -> None:
    if ctx is None:
        return
    if backend == "window" and threading.current_thread() is not threading.main_thread():
        return  # glfw's windows belong to the main thread
    with undisturbed():
        ctx.release()


def backend_of(backend: Any, device: Any) -> Any:
    """Split a backend's name into the backend and an EGL device.

    Raises
    ------
    SettingsError
        For an unknown name, an invalid device, and a device of another backend than EGL.
    """
    if not (isinstance(backend, str) and DEVICE.fullmatch(backend)):
        backend = one_of(*get_args(Backend))("backend", backend)
    number = optional(whole(0, 999), "the first")("device", device)
    if number is None:
        return backend
    if backend not in ("auto", "egl"):
        raise SettingsError(f"device={number} is one of EGL's: leave backend out, got backend={backend!r}")
    return f"egl:{number}"


def open_context(backend: Backend = "auto", context: moderngl.Context | None = None) -> GLContext:
    """Create a headless OpenGL 3.3 context, or adopt one. The context that was current before stays current.

    Parameters
    ----------
    backend
        "egl", "osmesa" or "window" (hidden); "auto" takes the first of these that works; "egl:1" is EGL on its second device.
    context
        A moderngl context of the calling program. Its state is restored after every frame; it is never released.

    Raises
    ------
    SettingsError
        If the backend has another name.
    ContextError
        If no backend works: every attempt, its reason and the remedy. If the given context is too old or cannot be
        used on this thread.
    """
    if not isinstance(backend, str) or (backend not in get_args(Backend) and not DEVICE.fullmatch(backend)):
        names = ", ".join(repr(name) for name in get_args(Backend))
        raise SettingsError(f"backend must be one of {names}, got {backend!r}")
    if _used_in and _used_in[0] != os.getpid():
        raise ContextError(
            "this process was forked from one that had already used OpenGL, and the driver's threads do not survive that: make "
            'the first Renderer after the fork, or start processes with multiprocessing.get_context("spawn")'
        )
    if context is not None:
        return _adopt(context)
    if backend != "auto":
        try:
            return _own(backend)
        except ContextError as error:
            raise ContextError(f"backend {backend!r} gives no OpenGL context: {error}") from error
    attempts = []
    for name in LOADERS:
        try:
            return _own(name)
        except ContextError as error:
            attempts.append(f"  {name}: {error}")
    raise ContextError("no backend gives an OpenGL 3.3 context; one of these must be mended:\n" + "\n".join(attempts))


def _own(backend: str) -> GLContext:
    ctx, loader = make_context(backend)
    try:
        return GLContext(ctx, backend, loader.switch, owned=True)
    except GlshadowError:
        ctx.release()
        raise


def _loader_of(ctx: moderngl.Context) -> Callable[[str], int]:
    # `_context` is private in moderngl 5.13; another version may rename it.
    loader = getattr(ctx.mglo, "_context", None)
    load: Callable[[str], int] = getattr(loader, "load_opengl_function", address)
    return load


def _adopt(ctx: moderngl.Context) -> GLContext:
    if not isinstance(ctx, moderngl.Context):
        raise SettingsError(f"context must be a moderngl.Context, got {type(ctx).__name__}")
    if ctx.version_code < MIN_VERSION:
        raise ContextError(f"the given context has OpenGL {ctx.version_code / 100:.1f}; 3.3 or newer is needed")
    loader = getattr(ctx.mglo, "_context", None)
    if isinstance(loader, Loader):
        return GLContext(ctx, "foreign", loader.switch, owned=False)
    before = current()
    # Not `with ctx`: moderngl keeps one predecessor, and this may already be inside such a block of the calling program.
    ctx.mglo.__enter__()
    try:
        place = current()
    finally:
        make_current(before)
    return GLContext(ctx, "foreign", Switch(place), owned=False)
