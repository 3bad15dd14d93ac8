"""The layer over torch, with a stand-in for torch: what it hands to autograd, what it takes back, and what it refuses."""

from __future__ import annotations

import subprocess
import sys
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

import glshadow as gs
import glshadow.torch
from glshadow.inverse.gradients import LightFunction

from ..tolerances import PATIENCE_S
from .test_gradients import POST

SIZE = (32, 18)
SUN = gs.DirectionalLight(direction=(-1.0, -1.5, 0.4), angle=3.0)


class Tensor:
    """A numpy array with the attributes of a tensor that glshadow.torch uses; `source` is the call that made it."""

    def __init__(self, array: Any, needs: bool = False, device: str = "cpu", source: Any = None) -> None:
        self.array, self.requires_grad, self.source = np.asarray(array), needs, source
        self.grad: Any = None
        self.device = SimpleNamespace(type=device)
        self.dtype = self.array.dtype

    def is_floating_point(self) -> bool:
        return self.array.dtype.kind == "f"

    def detach(self) -> Tensor:
        return Tensor(self.array)

    def double(self) -> Tensor:
        return Tensor(self.array.astype(np.float64))

    def numpy(self) -> np.ndarray:
        assert not self.requires_grad, "detach it first, as torch demands"
        return self.array

    def to(self, dtype: Any) -> Tensor:
        return Tensor(self.array.astype(dtype))

    def backward(self, cotangent: Tensor) -> None:
        kind, ctx, inputs = self.source
        given = kind.backward(ctx, cotangent)
        assert len(given) == len(inputs)
        for each, gradient in zip(inputs, given, strict=True):
            if isinstance(each, Tensor) and each.requires_grad:
                assert gradient.array.shape == each.array.shape
                assert gradient.dtype == each.dtype
                each.grad = gradient
            else:
                assert gradient is None


class Function:
    """torch.autograd.Function: apply calls forward with a context, whose tensors backward gets."""

    @classmethod
    def apply(cls, *inputs: Any) -> Tensor:
        ctx = SimpleNamespace(needs_input_grad=tuple(getattr(each, "requires_grad", False) for each in inputs))
        ctx.save_for_backward = lambda *tensors: setattr(ctx, "saved_tensors", tensors)
        result = cls.forward(ctx, *inputs)  # type: ignore[attr-defined]
        return Tensor(result.array, any(ctx.needs_input_grad), source=(cls, ctx, inputs))


@pytest.fixture
def torch(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    module = ModuleType("torch")
    module.Tensor, module.as_tensor = Tensor, Tensor  # type: ignore[attr-defined]
    once = SimpleNamespace(once_differentiable=lambda function: function)
    module.autograd = SimpleNamespace(Function=Function, function=once)  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "torch", module)
    return module


@pytest.mark.parametrize("output", ["visibility", "image"])
@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_values_and_gradients_are_those_of_the_function(
    torch: ModuleType, renderer: gs.Renderer, output: str, kind: type
) -> None:
    arrays = {"direction": np.array((-1.0, -1.5, 0.5)), "angle": np.array(4.0), "intensity": np.array([0.8])}
    tensors = {name: Tensor(array.astype(kind), needs=name != "angle") for name, array in arrays.items()}
    options: dict[str, Any] = {} if output == "visibility" else {"ambient": 0.1}
    got = getattr(gs.torch, output)(renderer, POST, None, SUN, tensors, SIZE, step=0.5, **options)
    name: Any = "visibility" if output == "visibility" else "linear"
    same = LightFunction(renderer, POST, None, SUN, name, SIZE, options, 0.5)
    values = {name: array.astype(kind).astype(np.float64) for name, array in arrays.items()}
    assert got.dtype == kind
    np.testing.assert_array_equal(got.array, same.at(values))
    weight = np.random.default_rng(1).normal(size=got.array.shape).astype(kind)
    got.backward(Tensor(weight))
    wanted = same.pulled_back(values, weight, ["direction", "intensity"])
    for key, gradient in wanted.items():
        np.testing.assert_array_equal(tensors[key].grad.array, gradient.astype(kind))
    assert tensors["angle"].grad is None
    assert np.abs(tensors["direction"].grad.array).max() > 0.0


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({}, "parameters must be tensors by the names of a light's settings"),
        ([1.0], "parameters must be tensors by the names"),
        ({"angle": 3.0}, r"parameters\['angle'\] must be a torch.Tensor of floating point, got 3.0"),
        ({"angle": Tensor(3)}, r"parameters\['angle'\] must be a torch.Tensor of floating point"),
        ({"angle": Tensor(3.0, device="cuda")}, r"parameters\['angle'\] must be on the CPU"),
        ({"radius": Tensor(3.0)}, "settings of DirectionalLight: direction, angle, intensity, color"),
    ],
    ids=["none", "list", "float", "integer", "cuda", "name"],
)
def test_parameters_that_are_not_tensors_are_refused(
    torch: ModuleType, renderer: gs.Renderer, parameters: Any, message: str
) -> None:
    with pytest.raises(gs.SettingsError, match=message):
        glshadow.torch.visibility(renderer, POST, None, SUN, parameters, SIZE)


def test_without_torch_an_error_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(gs.GlshadowError, match=r"needs torch .*pip install 'glshadow\[torch\]'"):
        glshadow.torch.image(None, POST, None, SUN, {"angle": 3.0}, SIZE)


def test_star_import_keeps_torch_and_import_does_without() -> None:
    """`from glshadow import *` must not replace the name torch."""
    code = (
        "torch = 1\nfrom glshadow import *\nassert torch == 1\n"
        "import glshadow, sys\nglshadow.torch.visibility\nassert 'torch' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=PATIENCE_S)
