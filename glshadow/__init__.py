"""glshadow: shadow mapping for Python, headless, with every image measurable against the exact answer.

What is public is listed in `glshadow.public`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from glshadow.core.cameras import Camera, IntrinsicsCamera, OrthographicCamera, PerspectiveCamera
from glshadow.core.distortion import BrownDistortion, Distortion, FisheyeDistortion
from glshadow.core.orbit import orbit
from glshadow.core.spaces import ClipSpace
from glshadow.derive.packed import PackedShadow
from glshadow.errors import (
    ContextError,
    GlshadowError,
    GlshadowWarning,
    MissingOutput,
    ReferenceUnavailable,
    ResourceError,
    SceneError,
    SettingsError,
    ShaderError,
)
from glshadow.io.limits import Limits
from glshadow.lights import (
    DirectionalLight,
    EnvironmentLight,
    EnvironmentMap,
    Light,
    PointLight,
    RectLight,
    SkyLight,
    SpotLight,
)
from glshadow.scene.capsules import Lines, Points
from glshadow.scene.mesh import AlphaMode, Material, Mesh
from glshadow.scene.nodes import Node, Scene
from glshadow.scene.texture import Sampler, Texture
from glshadow.scoring.error import Measurement, measure
from glshadow.scoring.score import Score
from glshadow.shadows import filters as _filters
from glshadow.shadows.bias import (
    Bias,
    ClipBias,
    ConstantBias,
    NoBias,
    NormalOffsetBias,
    ReceiverPlaneBias,
    SlopeScaledBias,
)
from glshadow.shadows.cookie import Cookie
from glshadow.shadows.filters import *  # noqa: F403  # every filter
from glshadow.shadows.fits import Cascades, Fit, Lispsm, SceneFit, ViewFit
from glshadow.shadows.metric import Target
from glshadow.shadows.shadow import Faces, Shadow

if TYPE_CHECKING:
    from glshadow import batch, image, overlay, scenes, study, video
    from glshadow.baking.bake import bake
    from glshadow.baking.baked import Baked
    from glshadow.derive.used import Used
    from glshadow.distorted import render_distorted
    from glshadow.frame import Frame
    from glshadow.gl.foreign import shaders
    from glshadow.gl.foreign.shaders import Caster, ShadowMap
    from glshadow.insolation.hours import sun_hours
    from glshadow.insolation.result import SunHours
    from glshadow.inverse.fit import FittedLight, fit_light
    from glshadow.io.colmap import ColmapImage, read_colmap
    from glshadow.io.load import load
    from glshadow.offscreen import PyrenderRenderer
    from glshadow.once import render, visibility
    from glshadow.outlines.outline import shadow_outline
    from glshadow.outlines.result import ShadowOutline
    from glshadow.outlines.surface import SurfaceOutline, surface_outline
    from glshadow.reference.blockers import Blockers, blockers
    from glshadow.reference.trace import trace
    from glshadow.reference.truth import Truth
    from glshadow.renderer import Renderer
    from glshadow.scoring.flip import Flip, flip
    from glshadow.shadows.view import ShadowView
    from glshadow.solar.path import SunPath, sun
    from glshadow.terrain.dem import Dem
    from glshadow.terrain.geotiff import read_dem
    from glshadow.terrain.shadow import TerrainRaster, terrain_horizon, terrain_shadow
    from glshadow.training.coco import to_coco
    from glshadow.training.masks import ShadowMasks, shadow_masks
    from glshadow.training.pairs import ShadowPair, shadow_pair
    from glshadow.ui.compare import Compared, Comparison, compare
    from glshadow.ui.explore import Explorer, explore
    from glshadow.ui.window import show
    from glshadow.web.export import export_page

__version__ = "0.1.0"  # here only: pyproject.toml reads it

# Imported on first access: OpenGL, file loading and ray tracing take time to import, and not every program needs them.
_LAZY = {
    "ColmapImage": "glshadow.io.colmap",
    "Compared": "glshadow.ui.compare",
    "Comparison": "glshadow.ui.compare",
    "Dem": "glshadow.terrain.dem",
    "Explorer": "glshadow.ui.explore",
    "FittedLight": "glshadow.inverse.fit",
    "Flip": "glshadow.scoring.flip",
    "Frame": "glshadow.frame",
    "PyrenderRenderer": "glshadow.offscreen",
    "Renderer": "glshadow.renderer",
    "Blockers": "glshadow.reference.blockers",
    "Baked": "glshadow.baking.baked",
    "bake": "glshadow.baking.bake",
    "Caster": "glshadow.gl.foreign.shaders",
    "ShadowMap": "glshadow.gl.foreign.shaders",
    "ShadowMasks": "glshadow.training.masks",
    "ShadowOutline": "glshadow.outlines.result",
    "ShadowPair": "glshadow.training.pairs",
    "ShadowView": "glshadow.shadows.view",
    "SunHours": "glshadow.insolation.result",
    "SunPath": "glshadow.solar.path",
    "TerrainRaster": "glshadow.terrain.shadow",
    "SurfaceOutline": "glshadow.outlines.surface",
    "Truth": "glshadow.reference.truth",
    "Used": "glshadow.derive.used",
    "blockers": "glshadow.reference.blockers",
    "compare": "glshadow.ui.compare",
    "explore": "glshadow.ui.explore",
    "export_page": "glshadow.web.export",
    "fit_light": "glshadow.inverse.fit",
    "flip": "glshadow.scoring.flip",
    "load": "glshadow.io.load",
    "read_colmap": "glshadow.io.colmap",
    "read_dem": "glshadow.terrain.geotiff",
    "render": "glshadow.once",
    "render_distorted": "glshadow.distorted",
    "shadow_masks": "glshadow.training.masks",
    "shadow_outline": "glshadow.outlines.outline",
    "shadow_pair": "glshadow.training.pairs",
    "show": "glshadow.ui.window",
    "sun": "glshadow.solar.path",
    "sun_hours": "glshadow.insolation.hours",
    "terrain_horizon": "glshadow.terrain.shadow",
    "terrain_shadow": "glshadow.terrain.shadow",
    "surface_outline": "glshadow.outlines.surface",
    "to_coco": "glshadow.training.coco",
    "trace": "glshadow.reference.trace",
    "visibility": "glshadow.once",
}
_MODULES = {
    "batch": "glshadow.batch",
    "image": "glshadow.image",
    "overlay": "glshadow.overlay",
    "scenes": "glshadow.scenes",
    "shaders": "glshadow.gl.foreign.shaders",
    "study": "glshadow.study",
    "torch": "glshadow.torch",  # not in __all__: `from glshadow import *` must not hide torch itself
    "video": "glshadow.video",
}


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        value: Any = import_module(_MODULES[name])
    elif name in _LAZY:
        value = getattr(import_module(_LAZY[name]), name)
    else:
        raise AttributeError(f"module 'glshadow' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)


__all__ = [
    "AlphaMode",
    "Baked",
    "Bias",
    "Blockers",
    "BrownDistortion",
    "Camera",
    "Cascades",
    "Caster",
    "ClipBias",
    "ClipSpace",
    "ColmapImage",
    "Compared",
    "Comparison",
    "ConstantBias",
    "ContextError",
    "Cookie",
    "Dem",
    "DirectionalLight",
    "Distortion",
    "EnvironmentLight",
    "EnvironmentMap",
    "Explorer",
    "Faces",
    "FisheyeDistortion",
    "Fit",
    "FittedLight",
    "Flip",
    "Frame",
    "GlshadowError",
    "GlshadowWarning",
    "IntrinsicsCamera",
    "Light",
    "Limits",
    "Lines",
    "Lispsm",
    "Material",
    "Measurement",
    "Mesh",
    "MissingOutput",
    "NoBias",
    "Node",
    "NormalOffsetBias",
    "OrthographicCamera",
    "PackedShadow",
    "PerspectiveCamera",
    "PointLight",
    "Points",
    "PyrenderRenderer",
    "ReceiverPlaneBias",
    "RectLight",
    "ReferenceUnavailable",
    "Renderer",
    "ResourceError",
    "Sampler",
    "Scene",
    "SceneError",
    "SceneFit",
    "Score",
    "SettingsError",
    "ShaderError",
    "Shadow",
    "ShadowMap",
    "ShadowMasks",
    "ShadowOutline",
    "ShadowPair",
    "ShadowView",
    "SkyLight",
    "SlopeScaledBias",
    "SpotLight",
    "SunHours",
    "SunPath",
    "SurfaceOutline",
    "Target",
    "TerrainRaster",
    "Texture",
    "Truth",
    "Used",
    "ViewFit",
    "__version__",
    "bake",
    "batch",
    "blockers",
    "compare",
    "explore",
    "export_page",
    "fit_light",
    "flip",
    "image",
    "load",
    "measure",
    "orbit",
    "overlay",
    "read_colmap",
    "read_dem",
    "render",
    "render_distorted",
    "scenes",
    "shaders",
    "shadow_masks",
    "shadow_outline",
    "shadow_pair",
    "show",
    "study",
    "sun",
    "sun_hours",
    "surface_outline",
    "terrain_horizon",
    "terrain_shadow",
    "to_coco",
    "trace",
    "video",
    "visibility",
]  # fmt: skip
__all__ += _filters.__all__
