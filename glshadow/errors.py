"""Every exception and warning of the package, as one tree.

Exception
└── GlshadowError
    ├── ContextError            no usable OpenGL context, or it lacks what was asked for
    ├── ResourceError           the driver ran out of memory for a map, an image or a mesh
    ├── SceneError              the model, mesh or file cannot be rendered as it is
    ├── SettingsError           a setting is out of range or two settings cannot work together (also a ValueError)
    │   └── MissingOutput       a frame was rendered without the output that is asked of it (also an AttributeError)
    ├── ShaderError             a GLSL snippet is missing, cyclic or does not compile
    └── ReferenceUnavailable    the ray-traced reference needs an extra that is not installed
UserWarning
└── GlshadowWarning             rendered, but not all that was given could be honoured
"""


class GlshadowError(Exception):
    """Base of all errors that glshadow raises on purpose."""


class ContextError(GlshadowError):
    """No usable OpenGL context could be made, or the given one lacks a required feature."""


class ResourceError(GlshadowError):
    """The driver could not allocate GPU memory."""


class SceneError(GlshadowError):
    """A model, mesh or file cannot be rendered as it is."""


class SettingsError(GlshadowError, ValueError):
    """A setting is out of its range, or two settings cannot work together."""


class MissingOutput(SettingsError, AttributeError):
    """A frame was rendered without the output that is asked of it; an AttributeError too, so that `hasattr` answers."""


class ShaderError(GlshadowError):
    """A GLSL snippet is missing, includes itself, or does not compile."""


class ReferenceUnavailable(GlshadowError):
    """The ray-traced reference needs an optional dependency that is not installed."""


class GlshadowWarning(UserWarning):
    """A picture was made, but something that was given could not be honoured."""
