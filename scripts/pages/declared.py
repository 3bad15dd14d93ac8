"""Tables of declarations in the code: biases, fits, limits, public modules."""

from __future__ import annotations

import inspect
from collections.abc import Iterable
from dataclasses import fields

import numpy as np

from glshadow.core.outputs import OUTPUTS, Output
from glshadow.core.spelling import Spelled
from glshadow.io.gltf.features import CORE, EXTENSIONS, Feature
from glshadow.io.limits import Limits
from glshadow.public import MODULES
from glshadow.shadows.bias import BIASES
from glshadow.shadows.fits import FITS
from scripts.pages.markdown import Blocks, table


def blocks() -> Blocks:
    """Tables made from the declarations."""
    bounds = [(f"`{each.name}`", f"{each.default:,.9g}", each.metadata["help"]) for each in fields(Limits)]
    return {
        "biases": _family(BIASES),
        "fits": _family(FITS),
        "glTF": table(("glTF 2.0", "how", "remark"), _features(CORE)),
        "glTF extensions": table(
            ("extension", "how", "remark"), [(f"`{name}`", *rest) for name, *rest in _features(EXTENSIONS)]
        ),
        "limits": table(("limit", "default", "what it bounds"), bounds),
        "outputs": table(
            ("output", "type, shape", "what it holds", "of", "without a surface", "EXR channels"), map(_output, OUTPUTS)
        ),
        "public": table(("module", "what it is for"), [(f"`{name}`", purpose) for name, purpose in MODULES.items()]),
    }


def _features(features: dict[str, Feature]) -> list[tuple[str, str, str]]:
    return [(name, feature.how, feature.remark) for name, feature in features.items()]


def _family(kinds: Iterable[type[Spelled]]) -> str:
    rows = [(f"`{kind.__name__}`", f"`{kind.usage()}`", _first_paragraph(kind)) for kind in kinds]
    return table(("setting", "spelled", "what it does"), rows)


def _output(output: Output) -> tuple[str, ...]:
    kind = f"{np.dtype(output.dtype).name} {output.shape}" if output.dtype else output.shape
    channels = " ".join(output.channels) + ".0, .1, ..." * (output.shape == "(lights, H, W)")
    return f"`{output.name}`", kind, output.holds, output.of.value, output.nothing, channels


def _first_paragraph(kind: type) -> str:
    return " ".join((inspect.getdoc(kind) or "").partition("\n\n")[0].split())
