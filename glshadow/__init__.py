"""glshadow: shadow mapping for Python, headless, with every picture measurable against the exact answer.

Public is what stands in `__all__` here, and in `__all__` of the modules among it:

    scenes      built-in scenes, some with their exact shadow       image      reading and writing pictures
    study       speed against error of many settings, plans         overlay    what explains a picture, drawn on it
    forward     the shadow in an own moderngl program

Everything else is private whatever it is called, and may change without a word. What `render`, `trace`, `measure` and a study give back
is made by them: its attributes and methods are public, its constructor is not.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from glshadow.core import filters as _filters
from glshadow.core.bias import ClipBias, ConstantBias, NoBias, NormalOffsetBias, ReceiverPlaneBias, SlopeScaledBias
from glshadow.core.cameras import Camera, IntrinsicsCamera, OrthographicCamera, PerspectiveCamera
from glshadow.core.filters import *  # noqa: F403  # every filter there is
from glshadow.core.fit import SceneFit, ViewFit
from glshadow.core.lights import DirectionalLight, PointLight, SpotLight
from glshadow.core.metric import Target
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
from glshadow.measure.error import ShadowError, measure  # now: the function must hide the room of its name
from glshadow.scene.limits import Limits
from glshadow.scene.mesh import AlphaMode, Material, Mesh, Node, Scene

if TYPE_CHECKING:
    from glshadow import image, overlay, study
    from glshadow.core.used import Used
    from glshadow.frame import Frame
    from glshadow.gl import forward
    from glshadow.measure.flip import flip
    from glshadow.reference.trace import trace
    from glshadow.reference.truth import Truth
    from glshadow.renderer import Renderer, render
    from glshadow.scene import builtin as scenes
    from glshadow.scene.load import load

__version__ = "0.1.0"  # here only: pyproject.toml reads it

# Imported when first asked for: OpenGL, file loading and ray tracing are not needed by everyone, and cost time.
_LAZY = {
    "Frame": "glshadow.frame",
    "Renderer": "glshadow.renderer",
    "Truth": "glshadow.reference.truth",
    "Used": "glshadow.core.used",
    "flip": "glshadow.measure.flip",
    "load": "glshadow.scene.load",
    "render": "glshadow.renderer",
    "trace": "glshadow.reference.trace",
}
_MODULES = {
    "forward": "glshadow.gl.forward",
    "image": "glshadow.image",
    "overlay": "glshadow.overlay",
    "scenes": "glshadow.scene.builtin",
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
    "Camera",
    "ClipBias",
    "ClipSpace",
    "ConstantBias",
    "ContextError",
    "DirectionalLight",
    "Faces",
    "Frame",
    "GlshadowError",
    "GlshadowWarning",
    "IntrinsicsCamera",
    "Limits",
    "Material",
    "Mesh",
    "MissingOutput",
    "NoBias",
    "Node",
    "NormalOffsetBias",
    "OrthographicCamera",
    "PerspectiveCamera",
    "PointLight",
    "ReceiverPlaneBias",
    "ReferenceUnavailable",
    "Renderer",
    "ResourceError",
    "Scene",
    "SceneError",
    "SceneFit",
    "SettingsError",
    "ShaderError",
    "Shadow",
    "ShadowError",
    "SlopeScaledBias",
    "SpotLight",
    "Target",
    "Truth",
    "Used",
    "ViewFit",
    "__version__",
    "flip",
    "forward",
    "image",
    "load",
    "measure",
    "overlay",
    "render",
    "scenes",
    "study",
    "trace",
]  # fmt: skip
__all__ += _filters.__all__
