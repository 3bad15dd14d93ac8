"""Functions of single snippets on the GPU, against their twins in float64."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import glshadow as gs
from glshadow.gl.driver.context import GLContext
from glshadow.shader.source import read
from glshadow.shadows.bias import receiver_plane_from_derivatives
from glshadow.shadows.filters.moments import chebyshev, spread
from glshadow.shadows.filters.msm import least_before
from glshadow.shadows.metric import unpack


def evaluated(
    context: GLContext, name: str, expression: str, before_it: str = "", **inputs: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Values (N, 4) of a snippet's expression (vec4) for each row of its inputs. `before_it`: text that it depends on."""
    ctx, count = context.ctx, len(next(iter(inputs.values())))
    types = {key: f"vec{value.shape[1]}" for key, value in inputs.items()}
    into = "".join(f"in {kind} a_{key};\nflat out {kind} {key};\n" for key, kind in types.items())
    copies = "".join(f"{key} = a_{key}; " for key in inputs)
    place = f"gl_Position = vec4((2.0 * float(gl_VertexID) + 1.0) / {count}.0 - 1.0, 0.0, 0.0, 1.0);"
    outof = "".join(f"flat in {kind} {key};\n" for key, kind in types.items()) + "out vec4 o_value;\n"
    head = "#version 330 core\n"
    program = ctx.program(
        f"{head}{into}void main() {{ {copies}{place} }}",
        f"{head}{outof}{before_it}{read(name)}void main() {{ o_value = {expression}; }}",
    )
    before, texture = ctx.fbo or ctx.detect_framebuffer(0), ctx.texture((count, 1), 4, dtype="f4")
    framebuffer, buffers = ctx.framebuffer([texture]), [ctx.buffer(value.tobytes()) for value in inputs.values()]
    formats = [f"{value.shape[1]}f" for value in inputs.values()]
    array = ctx.vertex_array(
        program, [(buffer, form, f"a_{key}") for buffer, form, key in zip(buffers, formats, inputs, strict=True)]
    )
    framebuffer.use()
    array.render(ctx.POINTS)
    found = np.frombuffer(texture.read(), np.float32).reshape(count, 4)
    before.use()
    for thing in (array, *buffers, framebuffer, texture, program):
        thing.release()
    return found


def test_plane_from_derivatives(glcontext: GLContext, rng: np.random.Generator) -> None:
    edge_on = [[(1.0, 2.0, 0.5), (2.0, 4.0, 3.0)], [(0.0, 0.0, 0.0), (1.0, 1.0, 1.0)]]  # the second: no extent
    # less and more edge-on than 2^-20 of the terms, the limit of a usable plane
    edge_on += [[(1.0, 1.0, 0.5), (1.0, 1.0 + k * 2.0**-23, 3.0)] for k in (15, 16, 17, 18)]
    dx, dy = np.concatenate([rng.normal(size=(50, 2, 3)), edge_on]).astype(np.float32).swapaxes(0, 1)
    call = "vec4(receiver_plane_from_derivatives(dx, dy), 0.0, 0.0)"
    found = evaluated(glcontext, "bias/receiver_plane_derivatives.glsl", call, dx=dx, dy=dy)[:, :2]
    expected = receiver_plane_from_derivatives(dx, dy)
    np.testing.assert_array_equal(found.any(axis=1), expected.any(axis=1))
    assert expected.any(axis=1).tolist()[-6:] == [False, False, False, False, True, True]
    # Three products and a quotient: relative to the cancelled terms, a few roundings.
    det = np.abs(dx[:, 0] * dy[:, 1] - dx[:, 1] * dy[:, 0])
    terms = 2.0 * np.abs(dx).max(axis=1) * np.abs(dy).max(axis=1)
    allowed = 8 * 2.0**-24 * terms / np.where(det == 0.0, 1.0, det) * (1.0 + np.abs(expected).max(axis=1))
    assert (np.abs(found - expected) <= allowed[:, None]).all()


def test_packing(glcontext: GLContext, rng: np.random.Generator) -> None:
    values = (10.0 ** rng.uniform(-7.0, 0.0, (512, 1))).astype(np.float32)
    values[:2, 0] = 0.0, 1.0 - 2.0**-24
    found = evaluated(glcontext, "lib/packing.glsl", "pack(value.x)", value=np.repeat(values, 2, axis=1))
    # A rounding for each digit; as bytes of the target, half a step of the finest besides.
    np.testing.assert_allclose(unpack(found), values[:, 0], rtol=4.0 * 2.0**-24)
    np.testing.assert_allclose(
        unpack(np.round(found * 255.0) / 255.0), values[:, 0], rtol=4.0 * 2.0**-24, atol=0.51 * 255.0**-4
    )


def test_unpacking(glcontext: GLContext, rng: np.random.Generator) -> None:
    stored = (rng.integers(0, 256, (512, 4)) / 255.0).astype(np.float32)
    stored[:4] = np.eye(4)
    found = evaluated(glcontext, "lib/packing.glsl", "vec4(unpack(stored))", stored=stored)[:, 0]
    # Each factor written with eight digits and each product rounded once; alone, in the first four, only the former.
    np.testing.assert_allclose(found[:4], unpack(stored[:4]), rtol=2.0**-24)
    np.testing.assert_allclose(found, unpack(stored), rtol=4.0 * 2.0**-24)


@pytest.mark.parametrize("bounded", [False, True])
def test_least_shadow(glcontext: GLContext, rng: np.random.Generator, bounded: bool) -> None:
    z, weights = rng.uniform(-0.95, 0.95, (600, 5)), rng.dirichlet(np.ones(5), 600)
    moments = np.stack([(weights * z**k).sum(axis=1) for k in range(1, 5)], axis=-1).astype(np.float32)
    x = rng.uniform(-0.95, 0.95, (600, 1)).astype(np.float32)
    call, define = "vec4(least_shadow(b, x.x))", f"#define GLS_HAUSDORFF {int(bounded)}\n"
    found = evaluated(glcontext, "lib/least_shadow.glsl", call, define, b=moments, x=np.repeat(x, 2, axis=1))[:, 0]
    expected, other = (
        least_before(moments.astype(np.float64), x[:, 0].astype(np.float64), each) for each in (bounded, not bounded)
    )
    # a Hankel matrix of random moments is inverted in float32: some are nearly singular
    assert np.quantile(np.abs(found - expected), 0.97) < 5e-3
    assert (np.abs(expected - other) > 0.02).sum() > 20, "the two problems differ"


@pytest.mark.parametrize("radius", [0, 1, 4])
def test_spread_of_a_plane(glcontext: GLContext, rng: np.random.Generator, radius: int) -> None:
    slope = rng.normal(size=(64, 2)).astype(np.float32)
    receiver = "Receiver(vec2(0.0), vec2(0.0), 0.0, slope)"
    call = f"vec4(plane_deviation({receiver}), plane_extent({receiver}), 0.0, 0.0)"
    text = f"#define GLS_MOMENT_RADIUS {radius}\n" + read("receiver/receiver.glsl")
    found = evaluated(glcontext, "lib/plane_spread.glsl", call, text, slope=slope)
    deviation, extent = spread(radius, slope.astype(np.float64))
    np.testing.assert_allclose(found[:, 0], deviation, rtol=1e-6)
    np.testing.assert_allclose(found[:, 1], extent, rtol=1e-6)


def test_chebyshev(glcontext: GLContext, rng: np.random.Generator) -> None:
    mean, x = rng.uniform(-1.0, 1.0, (2, 200, 1)).astype(np.float32)
    variance = rng.uniform(0.01, 0.5, (200, 1)).astype(np.float32)
    call = "vec4(chebyshev(m, x.x, 1e-6, 0.25))"
    given = np.concatenate([mean, mean**2 + variance], axis=1)
    found = evaluated(glcontext, "lib/chebyshev.glsl", call, m=given, x=np.repeat(x, 2, axis=1))[:, 0]
    bound = chebyshev(*given.T.astype(np.float64), x[:, 0].astype(np.float64), 1e-6)
    np.testing.assert_allclose(found, gs.Vsm(1, 0.25).unbled(bound), atol=1e-5)
