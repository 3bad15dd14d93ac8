"""Pixels whose visibility differs from float64 rays through their own centres and samples, whatever triangle was drawn there: per million
pixels of each model, under directional lights, a spot and a point light, and how much more than the reference they flicker with a rotating
camera. Models are drawn without their smooth normals and without culling: visibility is then that of their triangles.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np
from frame import MODELS, models_in

import glshadow as gs
from glshadow.core.sampling import offsets
from tests.tracer import Tracer, View, scene_triangles

SIZE = (480, 270)
FLICKER_SIZE = (320, 180)


def suns(generator: np.random.Generator, count: int) -> list[gs.DirectionalLight]:
    """Directional lights from random directions above."""
    found = []
    for _ in range(count):
        direction = generator.normal(size=3)
        direction /= np.linalg.norm(direction)
        direction[1] = -abs(direction[1]) - 0.05
        found.append(gs.DirectionalLight(direction=tuple(direction)))
    return found


def lamps(scene: gs.Scene) -> list[Any]:
    """A point and a spot light above the scene."""
    low, high = scene.bounds
    middle, extent = 0.5 * (low + high), float(np.linalg.norm(high - low))
    place = middle + extent * np.array([-0.5, 0.7, 0.2])
    return [
        gs.PointLight(position=tuple(middle + extent * np.array([0.4, 0.6, 0.3]))),
        gs.SpotLight(position=tuple(place), direction=tuple(middle - place), inner_angle=60.0, outer_angle=60.0),
    ]


def turned(camera: Any, angle: float, share: float = 1.0) -> Any:
    """The camera rotated about its target by an angle (radians), at a share of its distance."""
    eye, target = np.array(camera.position), np.array(camera.target)
    matrix = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    return replace(camera, position=tuple(target + share * matrix @ (eye - target)))


class Truth:
    """Visibility of a scene by float64 rays; pixels whose rays meet alpha-tested texels are not judged."""

    def __init__(self, scene: gs.Scene) -> None:
        self.scene = scene
        corners, self.node, _ = scene_triangles(scene)
        self.tracer = Tracer(corners)
        opaque = [node.mesh.material.alpha_mode.name == "OPAQUE" for node in scene.nodes]
        self.opaque = np.array(opaque)[self.node]

    def views(self, camera: Any, size: tuple[int, int], samples: int = 1) -> list[View]:
        """One view per sample position in a pixel."""
        return [View(self.scene, camera, size, tuple(place), tracer=self.tracer) for place in offsets(samples).tolist()]

    def visibility(self, views: list[View], light: Any) -> np.ndarray:
        """Mean over the views (H, W); NaN for pixels that are not judged."""
        found = []
        for view in views:
            sun = isinstance(light, gs.DirectionalLight)
            seen = (
                view.visibility(towards=-np.array(light.direction)) if sun else view.visibility(position=light.position)
            )
            judged = np.zeros(len(view.triangle), dtype=bool)
            blocker = view.blocker
            judged[view.rows] = self.opaque[view.triangle[view.rows]] & ((blocker < 0) | self.opaque[blocker])
            if isinstance(light, gs.SpotLight):
                away = view.points - np.array(light.position)
                inside = away @ np.array(light.direction) / np.linalg.norm(away, axis=1)
                judged[view.rows] &= inside > np.cos(np.radians(light.outer_angle - 0.5))
            found.append(np.where(judged.reshape(seen.shape), seen, np.nan))
        return np.asarray(np.mean(found, axis=0))


def isolated(visibility: np.ndarray) -> np.ndarray:
    """Pixels that differ from all eight around them."""
    padded = np.pad(visibility, 1, constant_values=np.nan)
    height, width = visibility.shape
    result = np.isfinite(visibility)
    for i, j in ((i, j) for i in range(3) for j in range(3) if (i, j) != (1, 1)):
        result &= padded[i : i + height, j : j + width] != visibility
    return result


def wrong(scene: gs.Scene, name: str, count: int, samples: int, renderer: gs.Renderer) -> dict[str, float]:
    """Per million judged pixels: wrong, isolated dark and light, and pixels that show another triangle."""
    generator = np.random.default_rng(len(name) * 7919 + 3)
    truth, sums = Truth(scene), np.zeros(5)
    cameras = [scene.camera, turned(scene.camera, generator.uniform(1, 5), 0.8)]
    for camera in cameras:
        views = truth.views(camera, SIZE, samples)
        for light in [*suns(generator, count), *lamps(scene)]:
            frame = renderer.render(scene, camera, [light], SIZE, outputs=("visibility", "triangle"), samples=samples)
            seen, true = frame.visibility[0], truth.visibility(views, light)
            with np.errstate(invalid="ignore"):
                judged = np.isfinite(seen) & np.isfinite(true)
                bad = judged & (np.abs(seen - true) > (0.5 if samples == 1 else 1.001 / samples))
            alone = bad & isolated(seen)
            other = judged & (frame.triangle != views[0].triangle.reshape(seen.shape)) if samples == 1 else bad & False
            sums += [judged.sum(), bad.sum(), (alone & (seen < true)).sum(), (alone & (seen > true)).sum(), other.sum()]
    names = ("wrong", "isolated dark", "isolated light", "another triangle")
    return {
        "pixels": int(sums[0]),
        **{key: float(value / sums[0] * 1e6) for key, value in zip(names, sums[1:], strict=True)},
    }


def flicker(scene: gs.Scene, name: str, renderer: gs.Renderer, frames: int = 60) -> dict[str, float]:
    """Isolated pixels that change between frames and back while a camera turns by 0.1 degree per frame, per million and frame."""
    truth = Truth(scene)
    light = gs.DirectionalLight(direction=(-0.5, -0.6, 0.3))
    counts: dict[str, list[float]] = {"ours": [], "truth": []}
    last: dict[str, list[np.ndarray]] = {"ours": [], "truth": []}
    for k in range(frames):
        camera = turned(scene.camera, np.radians(0.1) * k)
        frame = renderer.render(scene, camera, [light], FLICKER_SIZE, outputs=("visibility",), samples=1)
        now = {"ours": frame.visibility[0], "truth": truth.visibility(truth.views(camera, FLICKER_SIZE), light)}
        for whose, seen in now.items():
            last[whose] = [*last[whose], seen][-3:]
            if len(last[whose]) == 3:
                a, b, c = last[whose]
                finite = np.isfinite(a) & np.isfinite(b) & np.isfinite(c) & np.isfinite(now["truth"])
                counts[whose].append(float((finite & (a == c) & (a != b)).sum() / finite.sum() * 1e6))
    return {whose: float(np.mean(each)) for whose, each in counts.items()}


def scenes(folder: Path, only: str | None) -> Iterator[tuple[str, gs.Scene]]:
    """The models as placed by their files."""
    for name, up in MODELS:
        if only is None or only in name:
            yield name, flat(gs.load(folder / name, up_axis=up, look="plain"))


def flat(scene: gs.Scene) -> gs.Scene:
    """The scene without vertex normals and culled back faces, which the tracer does not have; nodes still share meshes."""
    meshes = {}
    for node in scene.nodes:
        material = replace(node.mesh.material, cull_back_faces=False)
        meshes[id(node.mesh)] = replace(node.mesh, normals=None, tangents=None, material=material)
    return replace(scene, nodes=tuple(replace(node, mesh=meshes[id(node.mesh)]) for node in scene.nodes))


@click.command(help=__doc__)
@click.option("--models", "folder", type=click.Path(exists=True, path_type=Path), help="Folder of the 12 models.")
@click.option(
    "--suns",
    "count",
    default=8,
    show_default=True,
    help="Directional lights for each of two cameras, in addition to a point and a spot light.",
)
@click.option(
    "--samples", type=click.Choice(["1", "4", "16"]), default="1", show_default=True, help="Samples per pixel."
)
@click.option("--only", help="Only models whose name contains this.")
@click.option("--flicker", "flickers", is_flag=True, help="Measure flicker with a rotating camera instead.")
@click.option("--json", "output", type=click.Path(path_type=Path), help="Write all figures there.")
def main(folder: Path | None, count: int, samples: str, only: str | None, flickers: bool, output: Path | None) -> None:
    warnings.simplefilter("ignore", gs.GlshadowWarning)
    folder = models_in(folder)
    if folder is None:
        raise click.UsageError("the 12 models are needed: --models FOLDER, or GLSHADOW_MODELS")
    results = {}
    with gs.Renderer() as renderer:
        for name, scene in scenes(folder, only):
            row = flicker(scene, name, renderer) if flickers else wrong(scene, name, count, int(samples), renderer)
            results[name] = row
            click.echo(f"{name}: " + ", ".join(f"{key} {value:.6g}" for key, value in row.items()))
    if output:
        output.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
