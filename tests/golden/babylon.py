"""Reads the golden file of Babylon.js shadow maps: texels with known world points, and the values that Babylon stored there.

The file's matrices are 16 numbers of a row-vector matrix, row by row; the same 16 numbers are a column-vector matrix
column by column, and that is how they are given here (`clip = transform @ [x, y, z, 1]`).
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from glshadow.core.spaces import Array, ClipSpace, look_at, orthographic, perspective, project
from glshadow.shadows.bias import bias_factor
from glshadow.shadows.metric import metric_range, projected_metric, radial_metric, window_depth
from glshadow.shadows.view import Projection

FILE_NAME = "babylon_depth_metric.json"
FACE_DIRECTIONS = np.array([[1, 0, 0], [-1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.float64)

# Tolerances between a read-back and the float64 metric.
F32_TOLERANCE = 5e-7  # float32 matrices and interpolation on slanted faces: the file's README; maximum seen 3.4e-7
PACKING_TOLERANCE = F32_TOLERANCE + 0.5 * 255.0**-4  # a float32 metric, then half a step of the finest byte
MATRIX_TOLERANCE = 8 * 2.0**-24  # entries stored as float32, a chain of at most eight roundings; times the largest term

PROJECTIONS: dict[str, Projection] = {"directional": "orthographic", "spot": "perspective", "point": "cube"}
"""Babylon's maps by kind of light."""


@dataclass(frozen=True, eq=False)
class Config:
    """One light, its map and its settings. `texture` is "f32", "f16" or "u8"; `filter` none, pcf, pcss or esm."""

    name: str
    kind: str
    filter: str
    texture: str
    clip: ClipSpace
    position: Array
    direction: Array | None
    near: float
    far: float
    half_window: float  # world units for a directional light, a tangent for the others
    bias: float
    normal_bias: float
    depth_scale: float
    handed: str
    depth_min_z: float  # Babylon's getDepthMinZ() and getDepthMaxZ()
    depth_max_z: float
    view: dict[int, Array]
    projection: dict[int, Array]
    transform: dict[int, Array]

    @property
    def shadow_view(self) -> Any:
        """What `metric_uniform` reads of a ShadowView."""
        return SimpleNamespace(projection=PROJECTIONS[self.kind], clip=self.clip, near=self.near, far=self.far)

    @property
    def has_metric(self) -> bool:
        """Whether the colour target holds the metric (pcf has only the depth attachment)."""
        return self.filter != "pcf"

    def own_matrix(self, face: int) -> tuple[Array, Array]:
        """Our (view_from_world, clip_from_view) for a face, from the light's numbers alone."""
        direction = FACE_DIRECTIONS[face] if self.direction is None else self.direction
        # Straight up or down the roll is arbitrary: there the file's own up vector is used.
        up = self.view[face][1, :3] if abs(direction[1]) > 0.999 * np.linalg.norm(direction) else (0.0, 1.0, 0.0)
        h = self.half_window
        build = orthographic if self.kind == "directional" else perspective
        projection = build(-h, h, -h, h, self.near, self.far, self.clip)
        return look_at(self.position, self.position + direction, up), projection


@dataclass(frozen=True, eq=False)
class Reading:
    """One texel. `clip` is before any bias; values that were not read are None."""

    config: Config
    face: int
    texel: tuple[int, int]
    world_point: Array
    plane_normal: Array
    light_view_z: float
    clip: Array
    documented_metric: float  # by the file's author from the documented formula, in float64
    documented_stored: float | None
    documented_depth: float | None
    read_metric: float | None  # contents of the colour target; for esm an exponential of the metric
    read_raw: Array | None
    read_depth: float | None

    @property
    def kinds(self) -> frozenset[str]:
        """Names of all values that this reading can verify."""
        config = self.config
        names = {f"light {config.kind}", f"filter {config.filter}", f"clip {config.kind} {config.clip}"}
        if self.read_metric is not None:
            names |= {f"metric {config.texture}", f"metric {config.kind} {config.texture}", f"stored {config.filter}"}
        if self.read_raw is not None:
            names.add(f"raw {config.texture}")
        if self.read_depth is not None:
            names |= {"depth", f"depth {config.kind} {config.filter}"}
        if config.bias:
            names |= {f"bias {config.kind}", f"bias {config.filter}"}
        if config.normal_bias:
            names.add("normalBias")
        if config.clip.reversed:
            names.add(f"reverse {config.kind}")
        if config.clip.zero_to_one:
            names.add(f"ndc01 {config.kind}")
        if config.kind == "point":
            names.add(f"face {self.face}")
        return frozenset({*names, f"{config.handed}-handed"})

    def biased_z(self, clip_z: float, clip_w: float) -> float:
        """Clip z as the depth attachment receives it."""
        config = self.config
        if config.filter not in ("pcf", "pcss"):
            return clip_z
        return clip_z + config.clip.sign * config.bias * clip_w * bias_factor(config.clip)

    def metric(self, clip: Array) -> float:
        """The metric that our core computes from the clip position (4,) before bias, bias included."""
        config = self.config
        low, high = metric_range(PROJECTIONS[config.kind], config.clip, config.near, config.far)
        if config.kind == "point":
            distance = float(np.linalg.norm(self.world_point - config.position))
            return float(radial_metric(distance, config.near, config.far)) + config.bias
        z = self.biased_z(float(clip[2]), float(clip[3]))
        return float(projected_metric(z, config.clip, low, high)) + config.bias

    def stored(self, clip: Array) -> float:
        """The expected colour target: the metric, or exp(-min(87, scale * metric)); 87 < ln(float32 max) = 88.7."""
        metric = self.metric(clip)
        return float(np.exp(-min(87.0, self.config.depth_scale * metric))) if self.config.filter == "esm" else metric

    def depth(self, clip: Array) -> float:
        """The expected depth attachment."""
        return float(window_depth([self.biased_z(float(clip[2]), float(clip[3])), float(clip[3])], self.config.clip))

    def file_clip(self) -> Array:
        """Clip position (4,) of the world point by the file's matrices."""
        return project(self.config.projection[self.face] @ self.config.view[self.face], self.world_point)

    def own_clip(self) -> Array:
        """Clip position (4,) of the world point by our matrices; x is minus that of Babylon's left-handed views."""
        view, projection = self.config.own_matrix(self.face)
        return project(projection @ view, self.world_point)

    def tolerance(self, stored: float) -> float:
        """Tolerance between the read metric and `stored`."""
        config = self.config
        if config.texture == "f16":
            # One ulp: llvmpipe truncates when it stores half floats, and what it truncates is a float32 metric.
            return float(np.spacing(np.float16(stored))) + F32_TOLERANCE
        if config.texture == "u8":
            return PACKING_TOLERANCE
        # d exp(-k m) = k exp(-k m) dm
        return F32_TOLERANCE * (config.depth_scale * stored if config.filter == "esm" else 1.0)


def golden_path() -> Path:
    """The file named by GLSHADOW_GOLDEN (itself or its folder), else the one beside the checkout."""
    default = Path(__file__).resolve().parents[3] / "shared" / "golden"
    path = Path(os.environ.get("GLSHADOW_GOLDEN") or default)
    return path / FILE_NAME if path.is_dir() or path.suffix != ".json" else path


def load_readings() -> list[Reading]:
    """All readings that are expected to match; without the file a failure where CI=true, else a skip."""
    path = golden_path()
    if not path.is_file():
        message = f"golden file {path} is missing; GLSHADOW_GOLDEN names it or its folder"
        if os.environ.get("CI") == "true":
            pytest.fail(message)
        pytest.skip("optional: " + message)
    return list(iterate_readings(json.loads(path.read_text(encoding="utf-8"))))


def iterate_readings(document: dict[str, Any]) -> Iterator[Reading]:
    """Readings of a parsed file, without those that carry a note ("not expected to match")."""
    for entry in document["configs"]:
        config = _config(entry)
        for row in entry["readings"]:
            if "note" in row:
                continue
            raw = row.get("read_raw")
            yield Reading(
                config,
                int(row["face"]),
                (row["texel"][0], row["texel"][1]),
                np.array(row["world_point"], dtype=np.float64),
                np.array(row["plane_normal"], dtype=np.float64),
                row["light_view_z"],
                np.array(row["clip"], dtype=np.float64),
                row["expected_metric"],
                row.get("expected_stored"),
                row.get("expected_depth"),
                row.get("read_metric"),
                None if raw is None else np.array(raw, dtype=np.float64),
                row.get("read_depth"),
            )


def _config(entry: dict[str, Any]) -> Config:
    light, engine, kind = entry["light"], entry["engine"], entry["config"]["light"]
    half_windows = {"directional": light.get("ortho_half"), "spot": np.tan(0.5 * light.get("angle", 0.0)), "point": 1.0}

    def matrices(name: str) -> dict[int, Array]:
        return {
            int(face): np.array(numbers[f"{name}_row_vector"], dtype=np.float64).reshape(4, 4, order="F")
            for face, numbers in entry["matrices"].items()
        }

    return Config(
        name=entry["name"],
        kind=kind,
        filter=entry["config"]["filter"],
        texture=engine["texture_type"],
        clip=ClipSpace(zero_to_one=engine["isNDCHalfZRange"], reversed=engine["useReverseDepthBuffer"]),
        position=np.array(light["position"], dtype=np.float64),
        direction=None if light["direction"] is None else np.array(light["direction"], dtype=np.float64),
        near=light["near"],
        far=light["far"],
        half_window=float(half_windows[kind]),
        bias=light["bias"],
        normal_bias=light["normalBias"],
        depth_scale=light["depthScale"],
        handed=light["handed"],
        depth_min_z=light["getDepthMinZ"],
        depth_max_z=light["getDepthMaxZ"],
        view=matrices("view"),
        projection=matrices("projection"),
        transform=matrices("transform"),
    )
