"""Conventions: the four clip spaces, view matrices, the bias matrix. rtol 1e-12: a dozen float64 operations."""

from __future__ import annotations

import numpy as np
import pytest

from glshadow.core.spaces import (
    CLIP_SPACES,
    Array,
    ClipSpace,
    bias_matrix,
    finite_vector,
    look_at,
    orthographic,
    perspective,
    project,
    rigid_inverse,
    transform,
    translation,
    unit,
    view_axes,
)
from glshadow.errors import GlshadowError, SettingsError
from glshadow.shadows.metric import window_depth

RTOL = 1e-12
NEAR, FAR = 0.5, 40.0
DISTANCES = np.array([0.5, 0.50001, 0.7, 1.0, 3.0, 17.0, 39.999, 40.0])
CLIP_IDS = [str(clip) for clip in CLIP_SPACES]


def window_depths(matrix: Array, clip: ClipSpace, distances: Array = DISTANCES) -> Array:
    points = np.stack([0.0 * distances, 0.0 * distances, -distances], axis=-1)
    return window_depth(project(matrix, points)[..., 2:], clip)


def test_clip_spaces_are_the_four() -> None:
    assert [str(clip) for clip in CLIP_SPACES] == ["-1..1", "-1..1,reversed", "0..1", "0..1,reversed"]
    assert [clip.sign for clip in CLIP_SPACES] == [1.0, -1.0, 1.0, -1.0]
    assert [clip.clear_depth for clip in CLIP_SPACES] == [1.0, 0.0, 1.0, 0.0]


@pytest.mark.parametrize("clip", CLIP_SPACES, ids=CLIP_IDS)
@pytest.mark.parametrize(("near", "far"), [(NEAR, FAR), (-3.0, 5.0), (-7.0, -2.0), (0.0, 1.0)])
def test_orthographic_window_depth_is_linear(clip: ClipSpace, near: float, far: float) -> None:
    distances = np.linspace(near, far, 7)
    depth = (distances - near) / (far - near)
    expected = 1.0 - depth if clip.reversed else depth
    matrix = orthographic(-2.0, 3.0, -1.0, 5.0, near, far, clip)
    np.testing.assert_allclose(window_depths(matrix, clip, distances), expected, rtol=RTOL, atol=1e-15)


@pytest.mark.parametrize("clip", CLIP_SPACES, ids=CLIP_IDS)
def test_perspective_window_depth_is_hyperbolic(clip: ClipSpace) -> None:
    depth = FAR * (DISTANCES - NEAR) / (DISTANCES * (FAR - NEAR))
    expected = NEAR * (FAR - DISTANCES) / (DISTANCES * (FAR - NEAR)) if clip.reversed else depth
    matrix = perspective(-0.4, 0.3, -0.2, 0.5, NEAR, FAR, clip)
    # -1..1 adds 0.5, which leaves an absolute error of eps; 0..1 keeps its relative one near 0.
    np.testing.assert_allclose(window_depths(matrix, clip), expected, rtol=RTOL, atol=1e-15)


@pytest.mark.parametrize("clip", CLIP_SPACES, ids=CLIP_IDS)
def test_near_and_far_planes_reach_the_ends_of_the_range(clip: ClipSpace) -> None:
    ends = np.array([NEAR, FAR])
    expected = [1.0, 0.0] if clip.reversed else [0.0, 1.0]
    for matrix in (orthographic(-1, 1, -1, 1, NEAR, FAR, clip), perspective(-1, 1, -1, 1, NEAR, FAR, clip)):
        np.testing.assert_allclose(window_depths(matrix, clip, ends), expected, rtol=RTOL, atol=1e-15)
        ndc = project(matrix, [[0.0, 0.0, -NEAR], [0.0, 0.0, -FAR]])
        lowest = 0.0 if clip.zero_to_one else -1.0
        expected_ndc = [1.0, lowest] if clip.reversed else [lowest, 1.0]
        np.testing.assert_allclose(ndc[:, 2] / ndc[:, 3], expected_ndc, rtol=RTOL, atol=1e-15)


@pytest.mark.parametrize("clip", CLIP_SPACES, ids=CLIP_IDS)
def test_window_edges_reach_the_edges_of_the_image(clip: ClipSpace) -> None:
    left, right, bottom, top = -0.4, 0.3, -0.2, 0.5
    corners = np.array([[left, bottom], [right, bottom], [right, top], [left, top]])
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    ortho = project(orthographic(left, right, bottom, top, NEAR, FAR, clip), np.c_[corners, np.full(4, -2.0)])
    np.testing.assert_allclose(ortho[:, :2], square, rtol=RTOL)
    np.testing.assert_array_equal(ortho[:, 3], 1.0)
    for distance in (NEAR, 3.0, FAR):
        points = np.c_[corners * distance, np.full(4, -distance)]
        clip_position = project(perspective(left, right, bottom, top, NEAR, FAR, clip), points)
        np.testing.assert_allclose(clip_position[:, :2] / clip_position[:, 3:], square, rtol=RTOL)
        np.testing.assert_allclose(clip_position[:, 3], distance, rtol=RTOL)


def test_orthographic_is_lunas_matrix_without_the_stray_term() -> None:
    """Luna's row-vector matrix for [-w/2, w/2] x [-h/2, h/2] x [n, f], printed with a stray 2/h in row 4."""
    w, h, n, f = 6.0, 4.0, NEAR, FAR
    luna = np.array([[2 / w, 0, 0, 0], [0, 2 / h, 0, 0], [0, 0, 1 / (f - n), 0], [0, 0, n / (n - f), 1]])
    ours = orthographic(-w / 2, w / 2, -h / 2, h / 2, n, f, ClipSpace(zero_to_one=True))
    right_from_left_handed = np.diag([1.0, 1.0, -1.0, 1.0])
    np.testing.assert_allclose(ours, luna.T @ right_from_left_handed, rtol=RTOL)
    # The printed one would move the centre of the box off the centre of the map.
    np.testing.assert_allclose(project(ours, [0.0, 0.0, -n]), [0.0, 0.0, 0.0, 1.0], atol=1e-15)


def test_matrices_of_opengl() -> None:
    """glOrtho and glFrustum as the OpenGL 2.1 specification prints them (section 2.11.2)."""
    left, right, bottom, top, n, f = -0.4, 0.3, -0.2, 0.5, NEAR, FAR
    gl_ortho = [
        [2 / (right - left), 0, 0, -(right + left) / (right - left)],
        [0, 2 / (top - bottom), 0, -(top + bottom) / (top - bottom)],
        [0, 0, -2 / (f - n), -(f + n) / (f - n)],
        [0, 0, 0, 1],
    ]
    np.testing.assert_allclose(orthographic(left, right, bottom, top, n, f), gl_ortho, rtol=RTOL)
    gl_frustum = [  # its window edges lie on the near plane, ours at distance 1
        [2 * n / (n * right - n * left), 0, (right + left) / (right - left), 0],
        [0, 2 * n / (n * top - n * bottom), (top + bottom) / (top - bottom), 0],
        [0, 0, -(f + n) / (f - n), -2 * f * n / (f - n)],
        [0, 0, -1, 0],
    ]
    np.testing.assert_allclose(perspective(left, right, bottom, top, n, f), gl_frustum, rtol=RTOL)


@pytest.mark.parametrize(
    ("near", "far"), [(0.0, 1.0), (-1.0, 1.0), (2.0, 2.0), (3.0, 2.0), (np.nan, 1.0), (1.0, np.nan), (1.0, np.inf)]
)
def test_perspective_refuses_an_impossible_range(near: float, far: float) -> None:
    with pytest.raises(SettingsError, match="0 < near < far") as caught:
        perspective(-1, 1, -1, 1, near, far)
    assert f"near={near}" in str(caught.value)
    assert f"far={far}" in str(caught.value)


@pytest.mark.parametrize("clip", CLIP_SPACES, ids=CLIP_IDS)
def test_bias_matrix(clip: ClipSpace) -> None:
    """Corner to (0, 0), opposite corner to (1, 1), centre to (0.5, 0.5); z to window depth; v up as GL's rows."""
    lowest = 0.0 if clip.zero_to_one else -1.0
    middle = 0.5 * (lowest + 1.0)
    ndc = np.array([[-1.0, -1.0, lowest], [1.0, 1.0, 1.0], [0.0, 0.0, middle], [-1.0, 1.0, 1.0]])
    expected = [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.5, 0.5, 0.5], [0.0, 1.0, 1.0]]
    np.testing.assert_allclose(transform(bias_matrix(clip), ndc), expected, atol=1e-15)
    # Scaling by w: it can be multiplied onto the projection before the division.
    matrix = bias_matrix(clip) @ perspective(-1, 1, -1, 1, NEAR, FAR, clip)
    uvz = project(matrix, [0.5, -1.0, -2.0])
    np.testing.assert_allclose(uvz[:2] / uvz[3], [0.625, 0.25], rtol=RTOL)
    np.testing.assert_allclose(
        uvz[2] / uvz[3], window_depths(perspective(-1, 1, -1, 1, NEAR, FAR, clip), clip, np.array([2.0]))[0], rtol=RTOL
    )


def test_bias_matrix_is_lunas_texture_matrix_with_rows_bottom_up() -> None:
    luna = np.array([[0.5, 0, 0, 0], [0, -0.5, 0, 0], [0, 0, 1, 0], [0.5, 0.5, 0, 1]]).T  # v down
    v_up = np.array([[1.0, 0, 0, 0], [0, -1, 0, 1], [0, 0, 1, 0], [0, 0, 0, 1]])
    np.testing.assert_array_equal(bias_matrix(ClipSpace(zero_to_one=True)), v_up @ luna)


def test_look_at_closed_form() -> None:
    """The textbook form: s = f x up, u = s x f, rows s, u, -f and the translated eye."""
    eye, target, up = np.array([9.0, 6.0, 11.0]), np.array([0.0, 1.0, -2.0]), np.array([0.1, 1.0, 0.2])
    f = (target - eye) / np.sqrt(((target - eye) ** 2).sum())
    s = np.cross(f, up) / np.sqrt((np.cross(f, up) ** 2).sum())
    u = np.cross(s, f)
    expected = np.array([[*s, -s @ eye], [*u, -u @ eye], [*-f, f @ eye], [0, 0, 0, 1]])
    np.testing.assert_allclose(look_at(eye, target, up), expected, rtol=RTOL, atol=1e-15)


def test_look_at_from_the_default_pose_is_the_identity() -> None:
    np.testing.assert_array_equal(look_at((0, 0, 0), (0, 0, -5)), np.eye(4))


def test_look_at_puts_the_eye_at_the_origin_and_the_target_ahead() -> None:
    eye, target = (3.0, -2.0, 7.0), (-1.0, 4.0, 0.5)
    view = look_at(eye, target)
    np.testing.assert_allclose(transform(view, eye), 0.0, atol=1e-14)
    distance = np.sqrt(16.0 + 36.0 + 42.25)
    np.testing.assert_allclose(transform(view, target), [0.0, 0.0, -distance], rtol=RTOL, atol=1e-14)
    assert transform(view, np.add(eye, (0.0, 1.0, 0.0)))[1] > 0  # up is up


@pytest.mark.parametrize("forward", [(0, 1, 0), (0, -1, 0), (0, -1, 1e-9), (1e-8, 1, 0)])
def test_look_at_with_up_along_the_view(forward: tuple[float, float, float]) -> None:
    view = look_at((1.0, 2.0, 3.0), np.add((1.0, 2.0, 3.0), forward))
    axes = view[:3, :3]
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0, rel=RTOL)
    np.testing.assert_allclose(axes[2], -np.array(forward) / np.linalg.norm(forward), atol=1e-7)


@pytest.mark.parametrize("length", [1e-200, 1e-20, 1.0, 1e20, 1e200])
def test_lengths_of_directions_do_not_matter(length: float) -> None:
    direction = np.array([-0.55, -0.8, -0.25])
    expected = direction / np.linalg.norm(direction)
    np.testing.assert_allclose(unit("direction", length * direction), expected, rtol=RTOL)
    up = np.array([0.3, 1.0, 0.1])
    np.testing.assert_allclose(
        look_at((0, 0, 0), length * direction, length * up), look_at((0, 0, 0), direction, up), rtol=1e-11
    )


@pytest.mark.parametrize(
    "value",
    [(0, 0, 0), (np.nan, 0, 1), (np.inf, 0, 1), (1, 2), (1, 2, 3, 4), "abc", None, 5.0, [[1, 2, 3]], [1, [2], 3]],
)
def test_unit_refuses(value: object) -> None:
    with pytest.raises(SettingsError, match="direction must"):
        unit("direction", value)  # type: ignore[arg-type]
    assert issubclass(SettingsError, ValueError)
    assert issubclass(SettingsError, GlshadowError)


def test_finite_vector_names_what_was_given() -> None:
    with pytest.raises(SettingsError, match=r"position must be 3 finite numbers, got \(1, nan, 3\)"):
        finite_vector("position", (1, np.nan, 3))
    with pytest.raises(SettingsError, match="principal must be 2"):
        finite_vector("principal", (1, 2, 3), 2)


@pytest.mark.parametrize(
    ("position", "target", "up"),
    [
        ((1, 2, 3), (1, 2, 3), (0, 1, 0)),
        ((1, 2, 3), (0, 0, 0), (0, 0, 0)),
        ((np.nan, 0, 0), (0, 0, 0), (0, 1, 0)),
        ((1, 0, 0), (0, np.inf, 0), (0, 1, 0)),
    ],
)
def test_look_at_refuses(position: object, target: object, up: object) -> None:
    with pytest.raises(SettingsError):
        look_at(position, target, up)  # type: ignore[arg-type]


def test_view_axes_and_rigid_inverse_undo_each_other() -> None:
    axes, origin = view_axes(unit("f", (1.0, -2.0, 0.5))), np.array([4.0, 5.0, -6.0])
    world_from_view = np.eye(4)
    world_from_view[:3, :3], world_from_view[:3, 3] = axes.T, origin
    np.testing.assert_allclose(rigid_inverse(axes, origin) @ world_from_view, np.eye(4), atol=1e-14)


def test_translation_transform_and_project_broadcast() -> None:
    points = np.arange(24.0).reshape(2, 4, 3)
    np.testing.assert_array_equal(transform(translation((1, 2, 3)), points), points + np.array([1, 2, 3]))
    homogeneous = project(translation((1, 2, 3)), points)
    assert homogeneous.shape == (2, 4, 4)
    np.testing.assert_array_equal(homogeneous[..., 3], 1.0)
