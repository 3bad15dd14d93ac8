"""Visibility from points on the courtyard's faces beside Embree: one sun, 100 suns, a light with a size.

Both keep what depends on the scene alone: Embree its tree, glshadow the triangles on the GPU. Every sun is another one, so that glshadow
builds its triangle lists again; points, normals and triangles are given. Embree traces occlusion rays (embreex, float32) from points that
face the light, offset along their normals. Rounds alternate in one process. CPU: processor time of all threads. Embree uses one thread,
glshadow those of the driver: LP_NUM_THREADS=0 for one of llvmpipe.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

import glshadow as gs
from glshadow.core.spaces import Array
from glshadow.reference.rays import Rays
from glshadow.scene.faces import face_corners, faces_of, fronts

OFFSET = 1e-4  # world units, of a scene of 24
SAMPLES = 64


def random_points(scene: gs.Scene, count: int) -> tuple[Array, NDArray[np.int64]]:
    """Points (N, 3) on faces chosen by area, and their triangles (N,)."""
    rng = np.random.default_rng(4)
    faces = faces_of(scene)
    corners = face_corners(scene, faces)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    chosen = rng.choice(len(faces), count, p=area / area.sum())
    u, v = rng.random((2, count, 1))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    a, b, c = corners[chosen].transpose(1, 0, 2)
    return a + u * (b - a) + v * (c - a), faces[chosen]


def suns(count: int, shift: int, angle: float = 0.0) -> list[gs.DirectionalLight]:
    """Suns on an arc, other ones in each round."""
    turns = np.linspace(0.15, 0.85, count + 2)[1:-1] * np.pi + 1e-3 * shift
    return [gs.DirectionalLight(direction=(np.cos(t), -np.sin(t), -0.3), angle=angle) for t in turns.tolist()]


class Embree:
    """Rays from points by embreex, as a user would cast them."""

    def __init__(self, scene: gs.Scene, points: Array, normals: Array) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self._scene = EmbreeScene()
        TriangleMesh(self._scene, np.ascontiguousarray(Rays(scene, np.zeros(3)).corners, dtype=np.float32))
        self._normals = normals.astype(np.float32)
        self._starts = (points + OFFSET * normals).astype(np.float32)

    def seen(self, towards: Any) -> NDArray[np.float32]:
        """Whether each point sees a direction (3,)."""
        aim = np.asarray(towards, dtype=np.float32)
        rows = np.flatnonzero(self._normals @ aim > 0.0)
        seen = np.zeros(len(self._starts), dtype=np.float32)
        aims = np.ascontiguousarray(np.broadcast_to(aim, (len(rows), 3)))
        seen[rows] = self._scene.run(self._starts[rows], aims, query="OCCLUDED") != 0
        return seen

    def share(self, light: gs.DirectionalLight) -> NDArray[np.float32]:
        """The share of a light's sample points that each point sees."""
        return np.mean([self.seen(each.to_light(np.zeros(3))[0]) for each in light.hard_lights(SAMPLES)], axis=0)


def _timed(jobs: dict[str, Callable[[int], Any]], rounds: int) -> tuple[dict[str, tuple[float, float]], dict[str, Any]]:
    """Least CPU and wall-clock seconds of each, after a first round that is not counted, and the last results."""
    taken: dict[str, list[tuple[float, float]]] = {name: [] for name in jobs}
    results: dict[str, Any] = {}
    for k in range(-1, rounds):
        for name, job in jobs.items():
            cpu, wall = time.process_time(), time.perf_counter()
            results[name] = job(k)
            if k >= 0:
                taken[name].append((time.process_time() - cpu, time.perf_counter() - wall))
    return {name: tuple(np.min(each, axis=0).tolist()) for name, each in taken.items()}, results


@click.command(help=__doc__)
@click.option("--points", "count", default=1_000_000, show_default=True, help="Points on the faces.")
@click.option("--rounds", default=3, show_default=True, help="Rounds; the least time counts.")
@click.option(
    "--soft-part", default=10, show_default=True, help="Embree traces one of so many points of the soft light."
)
@click.option("--json", "output", type=click.Path(path_type=Path), help="Write all figures there.")
def main(count: int, rounds: int, soft_part: int, output: Path | None) -> None:
    """Measure and print."""
    scene = gs.scenes.courtyard()
    scene = gs.Scene([gs.Node(gs.Mesh(n.mesh.positions, n.mesh.triangles), n.world_from_mesh) for n in scene.nodes])
    points, triangles = random_points(scene, count)
    normals = fronts(scene, triangles)
    embree, some = Embree(scene, points, normals), slice(None, None, soft_part)
    fewer = Embree(scene, points[some], normals[some])
    figures: dict[str, Any] = {}
    with gs.Renderer() as renderer:
        cases: dict[str, tuple[int, float, int]] = {"one sun": (1, 0.0, 1), "100 suns": (100, 0.0, 1),
                                                    f"a sun of 0.53 degrees, {SAMPLES} samples": (1, 0.53, soft_part)}  # fmt: skip
        for name, (number, angle, scale) in cases.items():

            def ours(k: int, number: int = number, angle: float = angle) -> Any:
                return renderer.visibility(scene, points, suns(number, k, angle), None, triangles, SAMPLES)

            def theirs(k: int, number: int = number, angle: float = angle) -> Any:
                if angle:
                    return [fewer.share(each) for each in suns(number, k, angle)]
                return [embree.seen(each.to_light(np.zeros(3))[0]) for each in suns(number, k)]

            taken, results = _timed({"glshadow": ours, "embree": theirs}, 1 if number > 1 else rounds)
            (cpu, wall), (their_cpu, their_wall) = taken["glshadow"], np.array(taken["embree"]) * scale
            differ = np.mean(np.abs(results["glshadow"][:, ::scale] - np.array(results["embree"])))
            figures[name] = {
                "cpu": cpu,
                "wall": wall,
                "embree cpu": their_cpu,
                "embree wall": their_wall,
                "difference": float(differ),
            }
            click.echo(f"{name:34s} glshadow {cpu:7.2f} s CPU {wall:7.2f} s; Embree {their_cpu:7.2f} s CPU {their_wall:7.2f} s; "
                       f"ratio {their_cpu / cpu:5.1f} CPU {their_wall / wall:5.1f}; mean difference {differ:.6f}")  # fmt: skip
    if output:
        output.write_text(json.dumps(figures, indent=1))


if __name__ == "__main__":
    main()
