"""glshadow: shadow mapping for Python, headless, with every picture measurable against the exact answer.

What is public is listed in `glshadow.public`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from glshadow.core import filters as _filters
from glshadow.core.bias import (
    Bias,
    ClipBias,
    ConstantBias,
    NoBias,
    NormalOffsetBias,
    ReceiverPlaneBias,
    SlopeScaledBias,
)
from glshadow.core.cameras import Camera, IntrinsicsCamera, OrthographicCamera, PerspectiveCamera
from glshadow.core.cookie import Cookie
from glshadow.core.filters import *  # noqa: F403  # every filter there is
from glshadow.core.fits import Cascades, Fit, Lispsm, SceneFit, ViewFit
from glshadow.core.metric import Target
from glshadow.core.orbit import orbit
from glshadow.core.packed import PackedShadow
from glshadow.core.shadow import Faces, Shadow
from glshadow.core.spaces import ClipSpace
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
from glshadow.lights import DirectionalLight, Light, PointLight, RectLight, SkyLight, SpotLight
from glshadow.measure.error import ShadowError, measure  # now: the function must hide the room of its name
from glshadow.measure.score import Score
from glshadow.scene.limits import Limits
from glshadow.scene.mesh import AlphaMode, Material, Mesh, Node, Scene

if TYPE_CHECKING:
    from glshadow import batch, image, overlay, study
    from glshadow.core.used import Used
    from glshadow.core.view import ShadowView
    from glshadow.frame import Frame
    from glshadow.gl import forward, shaders
    from glshadow.gl.shaders import Caster, ShadowMap
    from glshadow.measure.flip import Flip, flip
    from glshadow.offscreen import PyrenderRenderer
    from glshadow.reference.trace import trace
    from glshadow.reference.truth import Truth
    from glshadow.renderer import Renderer, render
    from glshadow.scene import builtin as scenes
    from glshadow.scene.load import load
    from glshadow.view.compare import Compared, Comparison, compare
    from glshadow.view.explore import Explorer, explore
    from glshadow.view.window import show
    from glshadow.web.export import export_page

__version__ = "0.1.0"  # here only: pyproject.toml reads it

# Imported when first asked for: OpenGL, file loading and ray tracing are not needed by everyone, and cost time.
_LAZY = {
    "Compared": "glshadow.view.compare",
    "Comparison": "glshadow.view.compare",
    "Explorer": "glshadow.view.explore",
    "Flip": "glshadow.measure.flip",
    "Frame": "glshadow.frame",
    "PyrenderRenderer": "glshadow.offscreen",
    "Renderer": "glshadow.renderer",
    "Caster": "glshadow.gl.shaders",
    "ShadowMap": "glshadow.gl.shaders",
    "ShadowView": "glshadow.core.view",
    "Truth": "glshadow.reference.truth",
    "Used": "glshadow.core.used",
    "compare": "glshadow.view.compare",
    "explore": "glshadow.view.explore",
    "export_page": "glshadow.web.export",
    "flip": "glshadow.measure.flip",
    "load": "glshadow.scene.load",
    "render": "glshadow.renderer",
    "show": "glshadow.view.window",
    "trace": "glshadow.reference.trace",
}
_MODULES = {
    "batch": "glshadow.batch",
    "forward": "glshadow.gl.forward",
    "image": "glshadow.image",
    "overlay": "glshadow.overlay",
    "scenes": "glshadow.scene.builtin",
    "shaders": "glshadow.gl.shaders",
    "study": "glshadow.study",
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
    "Bias",
    "Camera",
    "Cascades",
    "Caster",
    "ClipBias",
    "ClipSpace",
    "Compared",
    "Comparison",
    "ConstantBias",
    "ContextError",
    "Cookie",
    "DirectionalLight",
    "Explorer",
    "Faces",
    "Fit",
    "Flip",
    "Frame",
    "GlshadowError",
    "GlshadowWarning",
    "IntrinsicsCamera",
    "Light",
    "Limits",
    "Lispsm",
    "Material",
    "Mesh",
    "MissingOutput",
    "NoBias",
    "Node",
    "NormalOffsetBias",
    "OrthographicCamera",
    "PackedShadow",
    "PerspectiveCamera",
    "PointLight",
    "PyrenderRenderer",
    "ReceiverPlaneBias",
    "RectLight",
    "ReferenceUnavailable",
    "Renderer",
    "ResourceError",
    "Scene",
    "SceneError",
    "SceneFit",
    "Score",
    "SettingsError",
    "ShaderError",
    "Shadow",
    "ShadowError",
    "ShadowMap",
    "ShadowView",
    "SkyLight",
    "SlopeScaledBias",
    "SpotLight",
    "Target",
    "Truth",
    "Used",
    "ViewFit",
    "__version__",
    "batch",
    "compare",
    "explore",
    "export_page",
    "flip",
    "forward",
    "image",
    "load",
    "measure",
    "orbit",
    "overlay",
    "render",
    "scenes",
    "shaders",
    "show",
    "study",
    "trace",
]  # fmt: skip
__all__ += _filters.__all__
