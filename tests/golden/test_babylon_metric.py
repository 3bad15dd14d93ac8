"""The float64 metric against shadow maps that Babylon.js rendered."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from glshadow.core.spaces import CLIP_SPACES, Array, project
from glshadow.shadows.bias import normal_bias
from glshadow.shadows.metric import metric_range, pack, unpack

from .babylon import F32_TOLERANCE, FILE_NAME, MATRIX_TOLERANCE, PROJECTIONS, Reading, golden_path, load_readings

LIGHTS = ("directional", "spot", "point")
PROJECTED = ("directional", "spot")  # Babylon has no depth-texture filter for point lights

# Every kind of reading that must exist: otherwise the comparisons below would silently pass on a file that lost one.
EXPECTED_KINDS = sorted(
    {
        "depth",
        "normalBias",
        "left-handed",
        "right-handed",
        *(f"light {kind}" for kind in LIGHTS),
        *(f"filter {name}" for name in ("none", "pcf", "pcss", "esm")),
        *(f"stored {name}" for name in ("none", "pcss", "esm")),
        *(f"metric {texture}" for texture in ("f32", "f16", "u8")),
        *(f"raw {texture}" for texture in ("f32", "f16", "u8")),
        *(f"metric {kind} {texture}" for kind in LIGHTS for texture in ("f32", "f16", "u8")),
        *(f"clip {kind} {clip}" for kind in LIGHTS for clip in CLIP_SPACES),
        *(f"depth {kind} {name}" for kind in PROJECTED for name in ("pcf", "pcss")),
        *(f"bias {kind}" for kind in LIGHTS),
        *(f"bias {name}" for name in ("none", "pcf", "pcss")),
        *(f"reverse {kind}" for kind in LIGHTS),
        *(f"ndc01 {kind}" for kind in LIGHTS),
        *(f"face {face}" for face in range(6)),
    }
)

CLIPS: dict[str, Callable[[Reading], Array]] = {
    "recorded clip": lambda reading: reading.clip,
    "file's matrices": Reading.file_clip,
    "own matrices": Reading.own_clip,
}


@pytest.fixture(scope="module")
def readings() -> list[Reading]:
    return load_readings()


@pytest.fixture(params=CLIPS)
def clip_of(request: pytest.FixtureRequest) -> Callable[[Reading], Array]:
    return CLIPS[request.param]


def test_babylon_every_kind_of_reading_is_there(readings: list[Reading]) -> None:
    counts = Counter(kind for reading in readings for kind in reading.kinds)
    missing = [kind for kind in EXPECTED_KINDS if not counts[kind]]
    assert not missing, f"no reading of: {missing}"
    unknown = [kind for kind in counts if kind.split()[0] in ("light", "filter", "raw") and kind not in EXPECTED_KINDS]
    assert not unknown, f"no test here knows: {unknown}"


def test_babylon_every_reading_has_a_value_of_its_filter(readings: list[Reading]) -> None:
    for reading in readings:
        assert (reading.read_metric is not None) == reading.config.has_metric
        assert (reading.read_raw is not None) == reading.config.has_metric
        assert (reading.read_depth is not None) == (reading.config.filter in ("pcf", "pcss"))


def test_babylon_table_of_min_and_max_z(readings: list[Reading]) -> None:
    for config in {id(reading.config): reading.config for reading in readings}.values():
        expected = (config.depth_min_z, config.depth_max_z)
        assert metric_range(PROJECTIONS[config.kind], config.clip, config.near, config.far) == expected, config.name


def test_babylon_matrices_are_column_vector_matrices(readings: list[Reading]) -> None:
    for reading in readings:
        recorded, scale = reading.clip, _largest_term(reading)
        np.testing.assert_allclose(reading.file_clip(), recorded, rtol=0, atol=MATRIX_TOLERANCE * scale)
        by_transform = project(reading.config.transform[reading.face], reading.world_point)
        np.testing.assert_allclose(by_transform, recorded, rtol=0, atol=MATRIX_TOLERANCE * scale)


def test_babylon_clip_by_own_matrices(readings: list[Reading]) -> None:
    """Babylon draws its shadow maps left-handed, whatever the scene's handedness: only x is reversed."""
    for reading in readings:
        view, _ = reading.config.own_matrix(reading.face)
        mirror = np.sign(view[0, :3] @ reading.config.view[reading.face][0, :3])
        assert mirror != 0
        own = reading.own_clip() * [mirror, 1.0, 1.0, 1.0]
        np.testing.assert_allclose(own, reading.clip, rtol=0, atol=MATRIX_TOLERANCE * _largest_term(reading))
        distance = -(view @ [*reading.world_point, 1.0])[2]
        assert abs(distance - reading.light_view_z) <= MATRIX_TOLERANCE * _largest_term(reading)


def _largest_term(reading: Reading) -> float:
    """Size of the terms that cancel on the way to clip space: matrices times |world point|."""
    face, config = reading.face, reading.config
    in_view = np.abs(config.view[face]) @ np.abs([*reading.world_point, 1.0])
    return float(max(in_view.max(), (np.abs(config.projection[face]) @ in_view).max()))


@pytest.mark.parametrize(
    "kind",
    [
        *(f"metric {light} {texture}" for light in LIGHTS for texture in ("f32", "f16", "u8")),
        *(f"stored {name}" for name in ("none", "pcss", "esm")),
        "bias directional",
        "bias spot",
        "bias point",
        *(f"face {face}" for face in range(6)),
    ],
)
def test_babylon_stored_metric(readings: list[Reading], clip_of: Callable[[Reading], Array], kind: str) -> None:
    chosen = [reading for reading in readings if kind in reading.kinds and reading.read_metric is not None]
    assert chosen
    for reading in chosen:
        stored = reading.stored(clip_of(reading))
        assert abs(reading.read_metric - stored) <= reading.tolerance(stored), f"{reading.config.name} {reading.texel}"


@pytest.mark.parametrize("kind", PROJECTED)
@pytest.mark.parametrize("name", ["pcf", "pcss"])
def test_babylon_depth_attachment(
    readings: list[Reading], clip_of: Callable[[Reading], Array], name: str, kind: str
) -> None:
    chosen = [r for r in readings if r.config.filter == name and r.config.kind == kind]
    assert chosen
    for reading in chosen:
        assert reading.read_depth is not None
        depth = reading.depth(clip_of(reading))
        assert abs(reading.read_depth - depth) <= F32_TOLERANCE, f"{reading.config.name} {reading.texel}"


def test_babylon_documented_values(readings: list[Reading]) -> None:
    """The author's own evaluation of the documented formulas, rounded to 12 digits."""
    for reading in readings:
        clip = reading.clip
        assert reading.metric(clip) == pytest.approx(reading.documented_metric, rel=1e-9, abs=1e-10)
        if reading.documented_stored is not None:
            assert reading.stored(clip) == pytest.approx(reading.documented_stored, rel=1e-8, abs=1e-12)
        if reading.documented_depth is not None:
            assert reading.depth(clip) == pytest.approx(reading.documented_depth, rel=1e-9, abs=1e-10)


def test_babylon_bytes_unpack_to_the_metric(readings: list[Reading]) -> None:
    packed = [reading for reading in readings if reading.config.texture == "u8"]
    assert packed
    for reading in packed:
        assert reading.read_raw is not None
        assert reading.read_metric is not None
        metric = float(unpack(reading.read_raw / 255.0))
        assert metric == pytest.approx(reading.read_metric, rel=1e-11, abs=0)  # 12 digits in the file
        assert abs(metric - reading.stored(reading.clip)) <= reading.tolerance(metric)


def test_babylon_metric_packs_to_the_bytes(readings: list[Reading]) -> None:
    packed = [reading for reading in readings if reading.config.texture == "u8"]
    exact = 0
    for reading in packed:
        assert reading.read_raw is not None
        # From the float64 value of Babylon's own bytes: the same number, and the same bytes where no carry is possible.
        value = unpack(reading.read_raw / 255.0)
        again = np.rint(pack(value) * 255.0)
        assert abs(unpack(again / 255.0) - value) <= 4 * np.finfo(np.float64).eps
        if ((reading.read_raw > 0) & (reading.read_raw < 255)).all():
            np.testing.assert_array_equal(again, reading.read_raw)
            exact += 1
        # From our own metric: the same to within a float32 metric and half a step of the finest byte on either side.
        ours = np.rint(pack(reading.stored(reading.clip)) * 255.0)
        assert abs(unpack(ours / 255.0) - value) <= F32_TOLERANCE + 255.0**-4
    assert exact


def test_babylon_raw_is_the_metric_in_float_targets(readings: list[Reading]) -> None:
    for reading in readings:
        if reading.read_raw is not None and reading.config.texture != "u8":
            assert reading.read_raw[0] == reading.read_metric
            np.testing.assert_array_equal(reading.read_raw[1:], 1.0)


def test_babylon_normal_bias(readings: list[Reading]) -> None:
    """The square of an unbiased reading, moved by our formula and hit by the texel's light ray: the biased reading."""
    plain = {
        reading.texel: reading
        for reading in readings
        if reading.config.kind == "directional"
        and reading.config.filter == "none"
        and reading.config.texture == "f32"
        and reading.config.bias == 0
        and reading.config.normal_bias == 0
        and not reading.config.clip.zero_to_one
        and not reading.config.clip.reversed
    }
    biased = [reading for reading in readings if reading.config.normal_bias]
    assert biased
    for reading in biased:
        config, before = reading.config, plain[reading.texel]
        np.testing.assert_array_equal(before.plane_normal, reading.plane_normal)
        assert config.direction is not None
        direction = config.direction / np.linalg.norm(config.direction)
        moved = normal_bias(before.world_point, reading.plane_normal, -direction, config.normal_bias)
        slope = reading.plane_normal @ direction
        along = reading.plane_normal @ (moved - before.world_point) / slope
        point = before.world_point + along * direction
        # The file's points follow a direction that the view matrix holds as float32.
        np.testing.assert_allclose(point, reading.world_point, rtol=0, atol=1e-6)
        clip = project(config.projection[0] @ config.view[0], point)
        assert abs(reading.read_metric - reading.stored(clip)) <= F32_TOLERANCE
        # The bias matters: without it the reading would be off by far more than the tolerance.
        assert abs(reading.read_metric - reading.stored(before.clip)) > 100 * F32_TOLERANCE


def test_babylon_path_may_name_file_or_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("GLSHADOW_GOLDEN", str(tmp_path))
    assert golden_path() == tmp_path / FILE_NAME
    monkeypatch.setenv("GLSHADOW_GOLDEN", str(tmp_path / "other.json"))
    assert golden_path() == tmp_path / "other.json"


@pytest.mark.parametrize(("ci", "outcome"), [("true", pytest.fail.Exception), ("", pytest.skip.Exception)])
def test_babylon_missing_file(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, ci: str, outcome: type[BaseException]
) -> None:
    monkeypatch.setenv("GLSHADOW_GOLDEN", str(tmp_path))
    monkeypatch.setenv("CI", ci)
    with pytest.raises(outcome, match=FILE_NAME):
        load_readings()
