"""A light's shadow in other programs: `ShadowMap` draws the casters that their code draws, and generates the GLSL that samples the map.

The names NAME_visibility, NAME_towards, NAME_arriving and the interface of `ShadowMap` are stable within a major version. All other
functions, uniforms and macros of the GLSL, which also begin with NAME_, may change with any version: set the uniforms only with
`ShadowMap.apply`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Self

import moderngl
import numpy as np
from numpy.typing import ArrayLike

from glshadow.core.setting import as_floats, flag, instance, refuse, shown, text, whole
from glshadow.core.spaces import Array
from glshadow.derive.compare import rounding_of
from glshadow.derive.resolved import resolve_settings
from glshadow.errors import SettingsError
from glshadow.gl.driver.context import open_context
from glshadow.gl.driver.program import Programs, set_uniform
from glshadow.gl.foreign.forward import receiver_text
from glshadow.gl.passes.atlases import Atlas, layout
from glshadow.gl.passes.caster import Map, begin_view
from glshadow.gl.passes.moments import Moments
from glshadow.gl.techniques.mapped import uniforms_of
from glshadow.lights import Light
from glshadow.shadows.view import ShadowView, shadow_views

__all__ = ["Caster", "ShadowMap"]

_NAME = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")
_DRAWN = """
uniform mat4 u_lv_from_world;
// Share of the light that reaches a surface point, 0 to 1; 0 where the surface faces away, and outside a spot's cone.
float visibility_of(vec3 position_w, vec3 normal_w) {
    vec3 position = (u_lv_from_world * vec4(position_w, 1.0)).xyz, normal = mat3(u_lv_from_world) * normal_w;
    float cosine = dot(normal, light_arriving(position).xyz);
    return cosine > 0.0 && light_shines_on(position) ? light_visibility(position, normal, cosine) : 0.0;
}
// From a point to the light, unit length.
vec3 towards_of(vec3 position_w) {
    return light_arriving((u_lv_from_world * vec4(position_w, 1.0)).xyz).xyz * mat3(u_lv_from_world);
}
// Factor of the light's intensity at a point, by its range, falloff and cone.
float arriving_of(vec3 position_w) {
    return light_arriving((u_lv_from_world * vec4(position_w, 1.0)).xyz).w;
}
"""
_PUBLIC = {"visibility_of": "visibility", "towards_of": "towards", "arriving_of": "arriving"}
_CASTER = """#version 330
uniform mat4 u_clip_from_model;
in vec3 in_position;
void main() {
    gl_Position = u_clip_from_model * vec4(in_position, 1.0);
}
"""
_NOTHING = "#version 330\nvoid main() {}\n"


@dataclass(frozen=True, eq=False)
class Caster:
    """One view of a light, for code that draws the shadow casters.

    Attributes
    ----------
    clip_from_world : (4, 4) float64
        Row-major, as everywhere in Python.
    program : moderngl.Program
        Draws depth: attribute `in_position` (3 floats), uniform `u_clip_from_model`. Another program works too.
    """

    clip_from_world: Array
    program: moderngl.Program = field(repr=False)

    def place(self, world_from_model: ArrayLike | None = None) -> None:
        """Set the matrix of `program` for the next draw: model to world (4, 4); None: positions are given in world space."""
        member: Any = self.program["u_clip_from_model"]
        member.write(self.bytes_from(world_from_model))

    def bytes_from(self, world_from_model: ArrayLike | None = None) -> bytes:
        """Matrix for a vertex shader, clip from model space, as float32 in OpenGL's order; None: positions are given in world space."""
        matrix = self.clip_from_world
        if world_from_model is not None:
            given = as_floats(world_from_model, (4, 4))
            if given is None:
                raise refuse("world_from_model", "a 4 x 4 matrix, row-major", world_from_model)
            matrix = matrix @ given
        return np.ascontiguousarray(matrix.T, dtype=np.float32).tobytes()


class ShadowMap:
    """A light's shadow map inside another moderngl program.

    ::

        shadow = ShadowMap(ctx, gs.DirectionalLight(), bounds)
        program = ctx.program(VERTEX, shadow.source("sun") + FRAGMENT)  # FRAGMENT calls sun_visibility(position, normal)
        ...
        shadow.draw(casters)  # def casters(caster): caster.place(world_from_model); vertex_array_of(caster.program).render()
        shadow.apply(program, "sun", unit=3)

    All OpenGL state that its methods change is restored.

    Parameters
    ----------
    context : moderngl.Context
        Of the calling program; OpenGL 3.3.
    light : DirectionalLight, SpotLight or PointLight
        Settings come from its `shadow`; a filter that has no map becomes Pcf(1).
    bounds : (2, 3) array_like
        Least and greatest corner, world units, of what casts and receives.

    Attributes
    ----------
    light : Light
        The light of the map that `apply` binds.

    Raises
    ------
    SettingsError
        For a light without a shadow, a rectangular area light or a sky, a metric target, invalid bounds.
    """

    def __init__(self, context: moderngl.Context, light: Light, bounds: ArrayLike) -> None:
        self._context = open_context(context=instance(moderngl.Context)("context", context))
        with self._context.drawing():
            self._programs = Programs(self._context)
            self._caster = context.program(vertex_shader=_CASTER, fragment_shader=_NOTHING)
        self._moments: Moments | None = None
        self._map: Map | None = None
        self._sampled: Map
        self._released = False
        self.light: Light
        self.fit(light, bounds)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def fit(self, light: Light, bounds: ArrayLike | None = None) -> None:
        """Set another light of the same kind and settings, or other bounds. Nothing is drawn until `draw`; the GLSL stays valid."""
        shadow = getattr(light, "shadow", None)
        if shadow is None or light.wide:
            raise SettingsError(
                f"a ShadowMap needs a directional, spot or point light with a Shadow, got {shown(light)}"
            )
        if bounds is not None or self._map is None:
            corners = as_floats(bounds, (2, 3))
            if corners is None or not np.isfinite(corners).all() or not (corners[0] <= corners[1]).all():
                raise refuse("bounds", "the least and the greatest corner, 2 x 3 finite numbers", bounds)
            low, high = corners
            self._bounds = np.array(
                [[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
            )
        caps = self._context.caps
        resolved = shadow.resolved(with_map="a program of one's own")
        settings = resolve_settings(light, resolved, caps.clip_control, caps.renderer)
        if not settings.caster.target.is_depth:
            raise SettingsError(
                f"a ShadowMap draws depth, got target {settings.caster.target}: use DEPTH32F, DEPTH24 or DEPTH16"
            )
        guard = int(np.ceil(settings.filter.reach_texels + settings.caster.bias.shift_texels)) + 1
        views = shadow_views(
            light, [self._bounds], self._bounds, settings.clip, shadow.resolution or 2048, guard, fine=settings.fine,
            all_inside=False,
        )  # fmt: skip
        if not views:
            raise SettingsError(
                "nothing within the bounds can be lit by this light: give the bounds of what it shines on"
            )
        placed, size = layout(views, caps.max_texture_size)
        with self._context.drawing():
            if self._map is None or (self._map.atlas.size, self._map.settings) != (size, settings.caster):
                if self._map is not None:
                    self._map.atlas.release()
                atlas = Atlas(self._context, settings.caster.target, size)
            else:
                atlas = self._map.atlas
        self.light = light
        self._map = self._sampled = Map(placed, atlas, settings.caster, settings.filter)

    def draw(self, casters: Callable[[Caster], Any]) -> None:
        """Draw the casters: `casters` is called once for every view (six of a point light), with the view's framebuffer bound.

        It sets its own program and uniforms and draws; depth test, depth function and clip control are set already. An exception
        that it raises is passed on, and the map must be drawn again.
        """
        if self._map is None or self._released:
            raise SettingsError("this ShadowMap was released: make a new one")
        if not callable(casters):
            raise refuse("casters", "a callable that takes a Caster", casters)
        context, ctx, shadow_map = self._context, self._context.ctx, self._map
        atlas, settings = shadow_map.atlas, shadow_map.settings
        with context.drawing():
            try:
                for view in shadow_map.views:
                    begin_view(context, atlas, view, settings, view.clip.clear_depth)
                    atlas.framebuffer.use()
                    casters(Caster(view.clip_from_world, self._caster))
                    context.check_errors("drawing casters into a shadow map")
            finally:
                ctx.polygon_offset = (0.0, 0.0)
                ctx.depth_clamp_range = None
            self._sampled = shadow_map
            atlas.drawn[tuple(view.tile for view in shadow_map.views)] = (object(),)
            if shadow_map.filter.encoding:
                self._moments = self._moments or Moments(context)
                self._sampled = self._moments.filled(self._programs, shadow_map)

    def source(self, name: str = "shadow", version: bool = True) -> str:
        """GLSL 3.30 with three functions, to be prepended to a fragment shader.

        ::

            float NAME_visibility(vec3 position_w, vec3 normal_w)   visible share; 0 where it faces away or lies outside the cone
            vec3  NAME_towards(vec3 position_w)                     unit vector to the light
            float NAME_arriving(vec3 position_w)                    factor of the intensity by range, falloff and cone

        Parameters
        ----------
        name : str
            Prefix of all its names, lower case, such as "sun"; several lights in one shader need different ones.
        version : bool
            Whether to begin with `#version`; False for `context.includes` and after other text.
        """
        name, version = _name(name), flag()("version", version)
        head, _, body = receiver_text(self._context.caps, self.light, self._sampled).partition("\n")
        body = _renamed(body + _DRAWN, name)
        return f"{head}\n{body}" if version else body

    def include(self, name: str = "shadow") -> str:
        """Add the GLSL as `NAME.glsl` to the context's includes, for `#include "NAME.glsl"`; returns that name."""
        key = f"{_name(name)}.glsl"
        self._context.ctx.includes[key] = self.source(name, version=False)
        return key

    def apply(self, program: moderngl.Program, name: str = "shadow", unit: int = 0) -> None:
        """Set a program's uniforms and bind the map to a texture unit; uniforms that the compiler dropped are skipped.

        Call it after every `draw` and `fit`, and when another texture was bound to the unit.
        """
        program, name = instance(moderngl.Program)("program", program), _name(name)
        unit = whole(0, self._context.ctx.max_texture_units - 1)("unit", unit)
        shadow_map = self._sampled
        reach = float(np.abs(self._bounds).max()) + float(np.linalg.norm(self._bounds[-1] - self._bounds[0]))
        lv_from_world = self.light.frame(shadow_map.views, np.zeros(3))
        values = {
            **self.light.uniforms(lv_from_world[:3, :3]),
            **uniforms_of(shadow_map, rounding_of(reach)),
            "u_lv_from_world": lv_from_world,
            "u_falloff": self.light.shadow.edge_falloff if self.light.shadow else 0.0,
            "u_map": unit,
        }
        for key, value in values.items():
            member = program.get(f"{name}_{key}", None)
            if isinstance(member, moderngl.Uniform):
                set_uniform(member, value)
        texture = shadow_map.atlas.texture
        if not shadow_map.filter.encoding:
            # set on the texture itself, so that no sampler object stays on the unit
            raw = shadow_map.filter.reads_depths
            texture.compare_func = "" if raw else ">=" if shadow_map.views[0].clip.reversed else "<="
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        texture.use(unit)

    @property
    def views(self) -> Sequence[ShadowView]:
        """The views of the map: one, or six for a point light."""
        return self._sampled.views

    def release(self) -> None:
        """Free the GPU memory. May be called twice."""
        if self._released:
            return
        self._released = True
        with self._context.drawing():
            if self._map is not None:
                self._map.atlas.release()
            if self._moments is not None:
                self._moments.release()
            self._programs.release()
            self._caster.release()


_KEPT = {"main", "GLS_VERTEX"}
_FUNCTION = re.compile(
    r"^(?:const\s+)?(?:void|bool|int|uint|float|[biu]?vec[234]|mat[234]|[A-Z]\w*)\s+(\w+)\s*\(", re.MULTILINE
)
_STRUCT = re.compile(r"^struct\s+(\w+)", re.MULTILINE)
_GLOBAL = re.compile(r"^(?:uniform\s+|const\s+)?(?:highp\s+)?\w+\s+(\w+)(?:\[[^\]]*\])?\s*(?:=[^;]*)?;", re.MULTILINE)
_LIST = re.compile(r"^\w+\s+(\w+(?:\s*,\s*\w+)+)\s*;", re.MULTILINE)


def _name(name: str) -> str:
    kept: str = text()("name", name)
    if not _NAME.fullmatch(kept):
        raise refuse("name", "lower case letters and digits, words joined by _", name)
    return kept


def _renamed(code: str, name: str) -> str:
    """Prefix every name that the text declares, and every macro, with NAME_."""
    plain = re.sub(r"//[^\n]*", "", code)
    found = {*_FUNCTION.findall(plain), *_STRUCT.findall(plain), *_GLOBAL.findall(plain)}
    found |= {each.strip() for group in _LIST.findall(plain) for each in group.split(",")}
    found |= set(re.findall(r"#define\s+(\w+)", plain)) | set(re.findall(r"\bGLS_\w+", plain))
    names = {each: f"{name}_{_PUBLIC.get(each, each)}" for each in found - _KEPT}
    pattern = re.compile(r"(?<![.\w])(" + "|".join(sorted(map(re.escape, names), key=len, reverse=True)) + r")\b")
    return pattern.sub(lambda match: names[match[1]], plain)
