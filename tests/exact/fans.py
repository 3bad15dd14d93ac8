"""Rays at edges and vertices of closed triangle fans, tested by the filter's own GLSL: none may slip between two triangles.

The program is `light_visibility` of glsl/receiver/exact.glsl, its slot <candidates> filled by a loop over the fan instead of a list:
the vertex moved to the ray (`across`), the edges' signs (`turns`) and the decision (`met`) are the renderer's own. As a
control each fan is also tested with float32 triple products, which let rays slip.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glshadow.core.spaces import Array
from glshadow.derive.lists import CELLS, facets
from glshadow.gl.driver.buffers import texture_buffer
from glshadow.gl.driver.context import GLContext
from glshadow.gl.driver.entry_points import RGBA32F
from glshadow.gl.driver.program import Programs
from glshadow.scenes import shapes
from glshadow.scenes.shapes import Solid
from glshadow.shader import source

from .orientations import rotation

KINDS = ("orthographic", "perspective", "cube")
AT_VERTICES = 0.35  # share of the rays; the others pass an edge
ULPS = 3  # how far off, in units of the last place of each coordinate; 40 % of the rays: not at all
MOST = 24  # triangles round one edge
FACING = 1e-3  # minimum cosine between a fan's triangles and the light: none is edge-on
EDGES = 40_000

_FAN = """// Slot <candidates>: the triangles round one edge, all of them.
#ifndef GLS_MOST
#define GLS_MOST 1
#endif
layout(std430, binding = 0) readonly buffer Fans { int fans[]; }; // GLS_MOST per edge, -1: no more
int asked_edge;
bool slipped_control;

float triple(vec3 a, vec3 b, vec3 p) {
    return (a.y * b.z - a.z * b.y) * p.x + (a.z * b.x - a.x * b.z) * p.y + (a.x * b.y - a.y * b.x) * p.z;
}

bool blocked(Ray ray, vec2 cell, float face, float depth, bool asked) {
    bool hit = false, control = false;
    for (int i = 0; i < GLS_MOST; i++) {
        int triangle = fans[GLS_MOST * asked_edge + i];
        if (triangle < 0) break;
        Facet other = facet(triangle);
        hit = hit || met(turns(across(ray, other.a), across(ray, other.b), across(ray, other.c)));
#if GLS_AT_INFINITY
        vec3 a = vec3(other.a.xy, 1.0), b = vec3(other.b.xy, 1.0), c = vec3(other.c.xy, 1.0), p = vec3(ray.position.xy, 1.0);
#else
        vec3 a = other.a, b = other.b, c = other.c, p = ray.position;
#endif
        control = control || met(vec3(triple(a, b, p), triple(b, c, p), triple(c, a, p)));
    }
    slipped_control = !control;
    return hit && asked; // what lies in no cell is not asked
}
"""
_PASS = """// Asks each ray for its fan, and counts those that slip: by the filter's test, and by triple products.
layout(local_size_x = 64) in;
layout(std430, binding = 1) readonly buffer Rays { vec4 rays[]; }; // receiver in the light's frame, edge
layout(std430, binding = 2) buffer Slipped { uint slipped[2]; };
uniform int u_rays;
#include <shadow>

void main() {
    int number = int(gl_GlobalInvocationID.x);
    if (number >= u_rays) return;
    asked_edge = floatBitsToInt(rays[number].w);
    receiver_corner = vec3(0.0);
    receiver_triangle = -1;
    if (light_visibility(rays[number].xyz, vec3(0.0, 0.0, 1.0), 1.0) > 0.5) atomicAdd(slipped[0], 1u);
    if (slipped_control) atomicAdd(slipped[1], 1u);
}
"""
SNIPPETS = {"test/fan.glsl": _FAN, "test/slipped.comp": _PASS}


@dataclass(frozen=True)
class Fans:
    """A mesh in a light's frame and the fans to aim at.

    Attributes
    ----------
    corners : (T, 3, 3) float64
        Float32 values, relative to the light (directional: to the middle of its grid), z backward.
    edges : (E, 2, 3) float32
        Ends of the edges.
    around : (E, MOST) int32
        Triangles at either end of each edge, then -1.
    """

    kind: str
    corners: Array
    edges: NDArray[np.float32]
    around: NDArray[np.int32]


@contextmanager
def readable(snippets: Mapping[str, str]) -> Iterator[None]:
    """A test's snippets next to those of the glsl folder, for the composer."""
    read = source.read
    source.read = lambda name: snippets[name] if name in snippets else read(name)  # type: ignore[assignment]
    try:
        yield
    finally:
        source.read = read


def fans_of(solid: Solid, kind: str, rng: np.random.Generator) -> Fans:
    """Edges of a closed mesh whose adjacent triangles all face a light that stands beside it."""
    positions, triangles = solid
    size = float(np.abs(positions - positions.mean(axis=0)).max())
    local = (positions - positions.mean(axis=0)) @ rotation(rng).T
    # off the origin, as meshes are in real scenes: coordinates are larger than the differences between neighbours
    away = {"orthographic": (3.1, -2.3, 0.0), "perspective": (0.9, -0.5, -4.0), "cube": (-0.3, 2.4, 1.3)}[kind]
    vertices = (local + np.array(away) * size).astype(np.float32)
    corners = vertices.astype(np.float64)[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    towards = np.array([0.0, 0.0, 1.0]) if kind == "orthographic" else -corners[:, 0]
    length = np.linalg.norm(normal, axis=1) * np.linalg.norm(np.atleast_2d(towards), axis=1)
    facing = (normal * towards).sum(axis=1) > FACING * length
    ends, around = _edges(triangles, _whole(triangles, facing, len(vertices)), rng)
    return Fans(kind, corners, vertices[ends], around)


def _whole(triangles: NDArray[np.int32], facing: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
    """Vertices (V,) whose fans face the light and form one closed ring: as many edges as triangles, each edge shared by two."""
    whole = np.ones(count, dtype=bool)
    whole[triangles[~facing].ravel()] = False
    start, end = triangles.astype(np.int64).ravel(), triangles[:, [1, 2, 0]].astype(np.int64).ravel()
    edges, times = np.unique(np.minimum(start, end) * count + np.maximum(start, end), return_counts=True)
    odd = edges[times != 2]
    whole[odd // count] = whole[odd % count] = False
    return whole


def _edges(
    triangles: NDArray[np.int32], whole: NDArray[np.bool_], rng: np.random.Generator
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Ends (E, 2) of some edges between whole fans, and the triangles (E, MOST) round them."""
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).astype(np.int64)
    pairs = pairs[whole[pairs].all(axis=1)]
    pairs = pairs[rng.permutation(len(pairs))[:EDGES]]
    order = np.argsort(triangles.ravel(), kind="stable")
    start = np.searchsorted(triangles.ravel()[order], np.arange(len(whole) + 1))
    count = np.diff(start)[pairs]
    pairs, count = pairs[count.sum(axis=1) <= MOST], count[count.sum(axis=1) <= MOST]
    around = np.full((len(pairs), MOST), -1, dtype=np.int32)
    place = np.arange(MOST)
    first = place < count[:, :1]
    second = ~first & (place < count.sum(axis=1, keepdims=True))
    around[first] = (order[(start[pairs[:, 0]][:, None] + place)[first]]) // 3
    around[second] = (order[(start[pairs[:, 1]][:, None] + place - count[:, :1])[second]]) // 3
    return pairs, around


def rays_at(fans: Fans, count: int, rng: np.random.Generator) -> NDArray[np.float32]:
    """Receivers (count, 4) float32 behind edges and vertices, seen from the light, and the bits of their edge's number."""
    edge = rng.integers(0, len(fans.edges), count, dtype=np.int32)
    along = (0.5 * rng.random(count)).astype(np.float32)
    along[rng.random(count) < AT_VERTICES] = 0.0
    a, b = fans.edges[edge, 0], fans.edges[edge, 1]
    points = (a + along[:, None] * (b - a)).astype(np.float32)
    moved = rng.integers(-ULPS, ULPS + 1, points.shape) * (rng.random(count) < 0.6)[:, None]
    points = (points + moved * np.spacing(np.abs(points))).astype(np.float32)
    if fans.kind == "orthographic":
        points[:, 2] -= np.float32(5.0) * np.abs(fans.edges).max()
    else:
        points *= (1.0 + 2.0 * rng.random(count)).astype(np.float32)[:, None]
    return np.concatenate([points, edge.view(np.float32)[:, None]], axis=1)


def closed_box(rng: np.random.Generator) -> Fans:
    """A box round a point light, turned at random: its triangles meet every ray."""
    positions, triangles = shapes.box((1.0, 1.3, 0.8), (0.1, -0.2, 0.05))
    vertices = (positions @ rotation(rng).T).astype(np.float32)
    around = np.full((1, MOST), -1, dtype=np.int32)
    around[0, : len(triangles)] = np.arange(len(triangles))
    return Fans("cube", vertices.astype(np.float64)[triangles], np.zeros((1, 2, 3), dtype=np.float32), around)


def rays_on_seams(count: int, rng: np.random.Generator) -> NDArray[np.float32]:
    """Receivers (count, 4) float32 on and within ULPS of the planes where two or three of a point light's faces meet."""
    points = rng.uniform(-1.0, 1.0, (count, 3)).astype(np.float32)
    first, second = rng.permuted(np.tile(np.arange(3), (count, 1)), axis=1)[:, :2].T
    rows = np.arange(count)
    points[rows, first] = 1.0 + np.abs(points[rows, first])
    points[rows, second] = points[rows, first]
    corner = rng.random(count) < 0.2
    points[corner] = points[rows, first][corner, None]
    points *= rng.choice(np.array([-1.0, 1.0], dtype=np.float32), points.shape)
    points *= rng.uniform(2.0, 9.0, (count, 1)).astype(np.float32)
    moved = rng.integers(-ULPS, ULPS + 1, points.shape) * (rng.random(count) < 0.6)[:, None]
    points = (points + moved * np.spacing(np.abs(points))).astype(np.float32)
    return np.concatenate([points, np.zeros((count, 1), dtype=np.float32)], axis=1)


def slipped(context: GLContext, programs: Programs, fans: Fans, rays: NDArray[np.float32]) -> tuple[int, int]:
    """How many rays slip through their fan: by the filter's own test, and by float32 triple products."""
    ctx = context.ctx
    slots = {"shadow": "receiver/exact.glsl", "candidates": "test/fan.glsl"}
    defines = {
        "GLS_AT_INFINITY": int(fans.kind == "orthographic"),
        "GLS_POINT": int(fans.kind == "cube"),
        "GLS_CELLS": CELLS[fans.kind],
        "GLS_MOST": MOST,
    }
    with readable(SNIPPETS):
        program = programs.compute("test/slipped.comp", slots=slots, defines=defines)
    middle = 0.5 * CELLS[fans.kind]  # every ray falls into this cell; for a point light, into all cells of its face
    program.set(
        u_cells=(middle if fans.kind == "cube" else 0.0,) * 2 + (middle,) * 2, u_bound=(0.0, 0.0), u_rays=len(rays)
    )
    table = texture_buffer(context, facets(fans.corners, fans.corners, np.eye(3)).astype(np.float32), RGBA32F)
    buffers = [ctx.buffer(np.ascontiguousarray(data).tobytes()) for data in (fans.around, rays, np.zeros(2, np.uint32))]
    for binding, buffer in enumerate(buffers):
        buffer.bind_to_storage_buffer(binding)
    program.bind(u_facets=table)
    program.run(-(-len(rays) // 64))
    ctx.memory_barrier()
    ours, control = np.frombuffer(buffers[2].read(), dtype=np.uint32).tolist()
    table.release()
    for buffer in buffers:
        buffer.release()
    return ours, control
