"""Writes the page: geometry, shaders and all constants in one file that needs no server."""

from __future__ import annotations

import base64
import json
import os
from collections.abc import Mapping
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from glshadow.arguments import as_scene, frame_arguments, metered
from glshadow.core.cameras import Camera
from glshadow.core.setting import as_path, instance, one_of, optional, whole
from glshadow.core.spaces import Array, ClipSpace, world_positions
from glshadow.derive.compare import map_uniforms, rounding_of
from glshadow.derive.look import BACKGROUND, WHITE
from glshadow.errors import ResourceError, SettingsError, warn
from glshadow.files import replacing
from glshadow.gl.passes.atlases import layout
from glshadow.gl.passes.caster import metric_uniform
from glshadow.inline import words
from glshadow.lights import Light, Lights
from glshadow.scene.capsules import refuse_capsules
from glshadow.scene.nodes import Scene
from glshadow.shader.compose import compose
from glshadow.shader.slots import mapped_defines, mapped_slots, metric_slot
from glshadow.shadows.bias import ReceiverPlaneBias
from glshadow.shadows.filters import FILTERS, Filter, Pcf
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import Shadow
from glshadow.shadows.view import ShadowView, shadow_views

MOST_TRIANGLES = 2_000_000  # 144 bytes each, as text in the page
AMBIENT = 0.2  # linear, uniform
CLIP = ClipSpace(zero_to_one=False, reversed=False)  # WebGL's
MAP_SIDE = 4096  # supported by WebGL 1 devices


def export_page(
    scene: Any,
    folder: str | os.PathLike[str],
    camera: Camera | None = None,
    lights: Lights = None,
    resolution: int = 1024,
    filter: Filter | None = None,
    target: str = "packed",
) -> Path:
    """Write a page that shows a scene with the shadow of its first shadow-casting light. Mouse and touch rotate it; `d` shows the map.

    Parameters
    ----------
    scene : Scene, or anything that `load` takes
        Base colours and triangles; textures, blending and smooth normals are left out.
    folder : path
        Folder for `index.html`; created if it does not exist.
    camera, lights
        As for `Renderer.render`.
    resolution : int
        Texels along each side of a view's shadow map, 1 to 2048.
    filter : Filter, optional
        A filter that compares, without a depth texture; None: Pcf(1).
    target : {"packed", "unorm8"}
        What the shadow map stores: a metric in the four bytes of a pixel, or in one.

    Returns
    -------
    Path
        Path of the page.

    Raises
    ------
    SettingsError
        If no directional, spot or point light casts shadows, or WebGL 1 does not support the filter.
    ResourceError
        For more than two million triangles, or a folder that cannot be written.
    """
    scene = as_scene(scene)
    refuse_capsules(scene, "a page")
    camera, lights, _ = frame_arguments(scene, camera, lights, (640, 360))
    resolution = whole(1, 2048, unit="texels")("resolution", resolution)
    filter = optional(instance(Filter), "Pcf(1)")("filter", filter) or Pcf(1)
    target = one_of("packed", "unorm8")("target", target)
    if not filter.snippet or filter.encoding or filter.obeys_size:
        usable = ", ".join(
            kind.spelling for kind in FILTERS if kind.snippet and not kind().encoding and not kind().obeys_size
        )
        raise SettingsError(f"filter {filter} is not available in WebGL 1; available are: {usable}")
    casting = [each for each in lights if each.shadow is not None and not each.wide]
    if not casting:
        raise SettingsError("no directional, spot or point light casts a shadow: a page needs one")
    if len(lights) > 1:
        warn(f"the page shows only one light of {len(lights)}: {casting[0]!r}")
    triangles = sum(len(node.mesh.triangles) for node in scene.nodes)
    if triangles > MOST_TRIANGLES:
        raise ResourceError(
            f"{triangles} triangles exceed the limit of a page ({MOST_TRIANGLES}): export a simpler model"
        )
    light = casting[0]
    level = metered(scene, (light,), "scene")
    if level:  # as images are exposed by default
        light = replace(light, intensity=light.intensity * WHITE / level)
    data = _described(scene, camera, light, resolution, filter, Target.RGBA8 if target == "packed" else Target.R8)
    text = files("glshadow.web").joinpath("page.html").read_text(encoding="utf-8")
    path = as_path("folder", folder) / "index.html"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ResourceError(f"{path.parent} cannot be created: {error.strerror}") from None
    page = text.replace("$NAME$", words(scene.name)).replace('"$DATA$"', json.dumps(data).replace("</", "<\\/"))
    with replacing(path) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return path


def _described(
    scene: Scene, camera: Camera, light: Light, resolution: int, filter: Filter, target: Target
) -> dict[str, Any]:
    low, high = scene.extent
    origin = 0.5 * (low + high)  # origin of the page's coordinates: its floats have 32 bits
    corners, normals, nodes, first = [], [], [], 0
    drawn = [scene.nodes[i] for i in scene.drawn.tolist()]
    for node in drawn:
        mesh = node.mesh
        places = world_positions(mesh.positions.astype(np.float64), node.world_from_mesh, origin)[mesh.triangles]
        normal = np.cross(places[:, 1] - places[:, 0], places[:, 2] - places[:, 0])
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        corners.append(places.reshape(-1, 3))
        normals.append(np.repeat(normal / np.where(length > 0.0, length, 1.0), 3, axis=0))
        nodes.append(
            {
                "first": first,
                "count": 3 * len(mesh.triangles),
                "color": list(mesh.material.color[:3]),
                "casts": node.casts,
            }
        )
        first += 3 * len(mesh.triangles)
    boxes = scene.corners
    guard = int(np.ceil(filter.reach_texels)) + 1
    views = shadow_views(
        light, list(boxes), boxes[[node.casts for node in drawn]].reshape(-1, 3), CLIP, resolution, guard
    )
    if not views:
        raise SettingsError("the light does not reach the scene")
    placed, size = layout(views, MAP_SIDE)
    shadow = light.shadow or Shadow()
    bias = (shadow.bias or ReceiverPlaneBias()).derived(filter.reach_texels)
    slots = mapped_slots(light, target, bias, filter, "metric")
    defines = {**mapped_defines(light, target, bias, filter, False, True), "GLS_OUTPUT": 2, "GLS_TONE": 1}
    away = 0.0 if light.at_infinity else float(light.to_light(origin)[1])
    reach = float(np.abs(high - low).max()) + away
    moved = np.eye(4)
    moved[:3, 3] = origin  # world from the page's coordinates
    lv = light.frame(placed, np.zeros(3)) @ moved
    uniforms = {**light.uniforms(lv[:3, :3]), **map_uniforms(placed, size, target, bias, filter, rounding_of(reach))}
    uniforms |= {
        "u_ambient": (AMBIENT,) * 3,
        "u_strength": shadow.strength,
        "u_lv_from_mesh": lv,
        "u_normal_lv_from_mesh": lv[:3, :3],
    }
    packed: dict[str, int | str] = {"GLS_METRIC": 1, "GLS_PACKED": int(target is Target.RGBA8)}
    return {
        "geometry": _encoded(np.concatenate(corners)),
        "normals": _encoded(np.concatenate(normals)),
        "nodes": nodes,
        "radius": 0.5 * float(np.linalg.norm(high - low)) or 1.0,
        "background": list(BACKGROUND),
        "camera": _camera(camera, origin),
        "packed": target is Target.RGBA8,
        "map": {"size": list(size), "views": [_view(view, moved) for view in placed]},
        "caster": [
            _text("pass/caster.vert", {}, packed),
            _text("pass/caster.frag", {"metric": metric_slot(light.projection)}, packed),
        ],
        "receiver": [_text("pass/forward.vert", slots, defines), _text("pass/forward.frag", slots, defines)],
        "uniforms": {name: _plain(value) for name, value in uniforms.items()},
        "lv": lv.tolist(),
    }


def _text(name: str, slots: Mapping[str, str], defines: Mapping[str, int | str]) -> str:
    used = slots if name.endswith(".frag") else {}
    known = compose(name, "es100", used).declared
    return compose(name, "es100", used, {key: value for key, value in defines.items() if key in known}).code


def _view(view: ShadowView, moved: Array) -> dict[str, Any]:
    return {
        "tile": list(view.tile), "resolution": view.resolution, "clip": _plain(view.clip_from_world @ moved),
        "view": _plain(view.view_from_world @ moved), "metric": list(metric_uniform(view, 0.0)),
    }  # fmt: skip


def _camera(camera: Camera, origin: Array) -> dict[str, Any]:
    bottom, top = camera.window((1000, 1000))[2:]
    return {
        "position": (np.asarray(camera.position) - origin).tolist(), "target": (np.asarray(camera.target) - origin).tolist(),
        "up": list(camera.up), "tangent": 0.5 * float(top - bottom), "perspective": camera.is_perspective,
    }  # fmt: skip


def _plain(value: Any) -> Any:
    """Numbers, and lists of them; matrices in OpenGL's storage order."""
    if isinstance(value, bytes):
        return np.frombuffer(value, np.float32).tolist()
    if isinstance(value, np.ndarray):
        return value.T.astype(np.float64).ravel().tolist()
    return list(value) if isinstance(value, tuple) else value


def _encoded(values: Array) -> str:
    return base64.b64encode(values.astype("<f4").tobytes()).decode()
