"""Functions of materials on the GPU and in float64: reflection, its albedo, and what the surface buffer packs."""

from __future__ import annotations

import numpy as np
import pytest

from glshadow.core.spaces import Array
from glshadow.geometry.tangents import face_tangents
from glshadow.gl.driver.context import GLContext
from glshadow.lights.reflection import albedo, reflected
from glshadow.shader.source import read

from .test_twins_of_snippets import evaluated

UP = np.array([0.0, 0.0, 1.0])


def directions(rng: np.random.Generator, count: int) -> Array:
    """Unit vectors above the horizon."""
    found = rng.normal(size=(count, 3))
    found[:, 2] = np.abs(found[:, 2]) + 0.02
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def hemisphere(count: int) -> Array:
    """Directions (count^2, 3), as many in each part by the cosine: their mean integrates over irradiance."""
    share = (np.arange(count) + 0.5) / count
    rise, turn = np.sqrt(1.0 - share)[:, None], 2.0 * np.pi * share[None, :]
    side = np.sqrt(share)[:, None]
    found = np.stack([side * np.cos(turn), side * np.sin(turn), np.broadcast_to(rise, (count, count))], axis=-1)
    return found.reshape(-1, 3)


def furnace(color: float, metallic: float, roughness: float, cosine: float) -> float:
    """Light sent towards an eye at this cosine, of light 1 from everywhere."""
    lights = hemisphere(500)
    eye = np.array([np.sqrt(1.0 - cosine**2), 0.0, cosine])
    shape = lights.shape
    sent = reflected(
        np.full(shape, color), np.full(len(lights), metallic), np.full(len(lights), roughness),
        np.broadcast_to(UP, shape), np.broadcast_to(eye, shape), lights,
    )  # fmt: skip
    return float((sent[:, 0] / lights[:, 2]).mean())


@pytest.mark.parametrize("cosine", [0.1, 0.3, 0.7, 1.0])
@pytest.mark.parametrize("roughness", [0.3, 0.5, 0.8, 1.0])
def test_white_metal_in_uniform_light_is_white(roughness: float, cosine: float) -> None:
    """0.5 %: the table is interpolated, and its integral has 32 by 32 points."""
    assert furnace(1.0, 1.0, roughness, cosine) == pytest.approx(1.0, abs=5e-3)


def test_albedo_by_direct_integration() -> None:
    """A smooth surface returns all; a rough one what the lobe's integral says."""
    ones = np.ones(1)
    assert albedo(0.0 * ones, ones)[0] == 1.0
    # at roughness 1 and normal incidence the lobe is 1 / (2 pi (1 + cos)): its integral is (1 - ln 2) of the half sphere
    assert albedo(ones, ones)[0] == pytest.approx(1.0 - np.log(2.0), abs=1e-3)


def test_reciprocity_and_horizon(rng: np.random.Generator) -> None:
    """Without the factor for lost light, which depends on the eye alone, eye and light may change places."""
    count = 200
    eyes, lights = directions(rng, count), directions(rng, count)
    up, ones = np.tile(UP, (count, 1)), np.ones(count)
    for metallic, roughness in ((1.0, 0.3), (1.0, 1.0)):
        there, back = (
            reflected(np.zeros((count, 3)), metallic * ones, roughness * ones, up, a, b) / b[:, 2:]
            for a, b in ((eyes, lights), (lights, eyes))
        )
        np.testing.assert_allclose(there, back, rtol=1e-9)
    below = lights * (1.0, 1.0, -1.0)
    assert not reflected(np.ones((count, 3)), ones, ones, up, eyes, below).any()


def test_rough_formula_equals_the_general_one(glcontext: GLContext, rng: np.random.Generator) -> None:
    count = 300
    eyes, lights = directions(rng, count), directions(rng, count)
    found = evaluated(
        glcontext, "lib/reflection.glsl", "vec4(reflected_roughly(vec3(0.0, 0.0, 1.0), eye, light), 0.0, 0.0)",
        eye=eyes.astype(np.float32), light=lights.astype(np.float32),
    )  # fmt: skip
    color = rng.uniform(0.0, 1.0, (count, 3))
    ours = (color * found[:, :1] + found[:, 1:2]) * lights[:, 2:]
    zeros, up = np.zeros(count), np.tile(UP, (count, 1))
    # the loss is a straight line there: 0.01 of a specular part of at most a few hundredths, but for grazing angles
    np.testing.assert_allclose(ours, reflected(color, zeros, zeros + 1.0, up, eyes, lights), atol=2e-3, rtol=0.01)


def test_packed_material(glcontext: GLContext, rng: np.random.Generator) -> None:
    values = rng.uniform(0.0, 1.0, (256, 4)).astype(np.float32)
    values[:3] = (0, 0, 0, 0), (1, 1, 1, 1), (1, 2, 0, 1)
    found = evaluated(glcontext, "lib/material_packing.glsl", "unpack_material(pack_material(value))", value=values)
    steps = np.array([255.0, 254.0, 255.0, 255.0])
    np.testing.assert_allclose(found, np.minimum(np.rint(values * steps), 255.0) / steps, atol=1.01 / 254.0)
    assert found[1].tolist() == [1.0, 1.0, 1.0, 1.0]
    assert found[2, 1] > 1.0, "matte"


def test_packed_emission(glcontext: GLContext, rng: np.random.Generator) -> None:
    light = (2.0 ** rng.uniform(-12.0, 15.9, (512, 1)) * rng.uniform(0.0, 1.0, (512, 3))).astype(np.float32)
    light[:6] = (0, 0, 0), (0.5, 0.5, 0.5), (1, 0, 0), (65408, 1, 0), (1e9, 0, 0), (0.25, 1, 4)
    call = "vec4(unpack_emission(pack_emission(value)), 0.0)"
    found = evaluated(glcontext, "lib/emission_packing.glsl", call, value=light)[:, :3]
    assert found[0].tolist() == [0, 0, 0]
    assert found[1].tolist() == [0.5, 0.5, 0.5]
    assert found[2].tolist() == [1, 0, 0]
    expected = np.minimum(light, 65536.0)
    scale = 2.0 ** np.ceil(np.log2(np.maximum(expected.max(axis=1, keepdims=True), 1e-9)))
    # half a step of the root, times twice the root
    allowed = scale * (np.sqrt(expected / scale) + 0.5 / 511.0) / 511.0
    assert (np.abs(found - expected) <= allowed + 1e-4 * scale).all()


@pytest.mark.parametrize("define", ["", "#define GLS_OCTAHEDRAL 1\n"])
def test_packed_directions(glcontext: GLContext, rng: np.random.Generator, define: str) -> None:
    vectors = rng.normal(size=(512, 3))
    vectors[:6] = np.concatenate([np.eye(3), -np.eye(3)])
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    found = evaluated(
        glcontext, "lib/direction.glsl", "vec4(normalize(unpack_direction(pack_direction(value))), 0.0)",
        define + (read("lib/octahedral.glsl") if define else ""), value=vectors.astype(np.float32),
    )[:, :3]  # fmt: skip
    angle = np.linalg.norm(np.cross(found, vectors), axis=1)
    assert (np.einsum("ij,ij->i", found, vectors) > 0.9).all()
    assert angle.max() < (1e-4 if define else 2e-3)


def test_face_tangents(rng: np.random.Generator) -> None:
    """u grows along the tangent, v along cross(normal, tangent) times the sign; degenerate ones are zero."""
    corners, uv = rng.normal(size=(200, 3, 3)), rng.normal(size=(200, 3, 2))
    tangents, normals = face_tangents(corners, uv)
    e, f = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    jacobian = np.stack([e, f], axis=-1) @ np.linalg.inv(np.stack([a, b], axis=-1))  # d position / d(u, v)
    along = jacobian[..., 0] / np.linalg.norm(jacobian[..., 0], axis=1, keepdims=True)
    np.testing.assert_allclose(tangents[:, :3], along, atol=1e-9)
    third = np.cross(normals, tangents[:, :3]) * tangents[:, 3:]
    assert (np.einsum("ij,ij->i", third, jacobian[..., 1]) > 0.0).all()
    uv[0], corners[1] = uv[0, :1], corners[1, :1]
    tangents, normals = face_tangents(corners, uv)
    assert not tangents[0, :3].any()
    assert not normals[1].any()
    assert np.isfinite(tangents).all()
