"""The public API: the names in `__all__` of these modules, and members of their classes without a leading underscore.

Everything else is private, even if its name has no underscore: it may change or be removed without notice. Public names change only
with an entry in the change log. The API reference (scripts/docs) and its tests are made from this list.
"""

MODULES = {
    "glshadow": "scenes, lights, cameras, settings; render, trace, measure",
    "glshadow.scenes": "the built-in scenes, as glshadow.scenes",
    "glshadow.study": "speed against error over a grid of settings, and the cheapest for a budget",
    "glshadow.batch": "many images from a file of jobs, in processes or on a cluster",
    "glshadow.overlay": "maps, lights, axes and a grid drawn on top of an image",
    "glshadow.image": "images read from files and written to them",
    "glshadow.video": "moving images written to files",
    "glshadow.torch": "visibility and images as functions that PyTorch differentiates",
    "glshadow.gl.foreign.shaders": "a light's shadow in other moderngl programs, as glshadow.shaders",
}
"""Module -> its purpose."""
