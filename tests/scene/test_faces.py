"""Points on faces: on their triangles, one in each part, with the triangles' areas, independent of what else is sampled."""

import numpy as np
import pytest

import glshadow as gs
from glshadow.scene.faces import face_corners, faces_of, sample_faces

PATCH = gs.Mesh([(0, 0, 0), (4, 0, 0), (0, 4, 0), (4, 4, 0)], [(0, 1, 2), (1, 3, 2), (0, 0, 1)])


def moved(x):
    matrix = np.eye(4)
    matrix[:3, 3] = x, 2.0, 3.0
    return matrix


@pytest.fixture
def scene():
    points = gs.Points([(9.0, 9.0, 9.0)], radius=0.1)
    return gs.Scene([gs.Node(PATCH), gs.Node(points), gs.Node(PATCH, moved(10.0))])


def test_areas_and_numbers(scene):
    found = sample_faces(scene, 5)
    assert found.triangles.tolist() == np.repeat([0, 1, 2, 4, 5, 6], 5).tolist()
    assert found.areas.reshape(-1, 5).sum(axis=1).tolist() == [8.0, 8.0, 0.0, 8.0, 8.0, 0.0]
    assert faces_of(scene).tolist() == [0, 1, 2, 4, 5, 6]


def test_points_are_on_their_triangles(scene):
    points, triangles, _ = sample_faces(scene, 16)
    a, b, c = face_corners(scene, triangles).transpose(1, 0, 2)
    assert (points[:, 2] == a[:, 2]).all()
    area = [np.cross(q - p, points - p)[:, 2] for p, q in ((a, b), (b, c), (c, a))]
    assert min(each.min() for each in area) >= 0.0


@pytest.mark.parametrize("level", [1, 2, 3])
def test_one_point_in_each_part(scene, level):
    points = sample_faces(scene, 4**level, faces=[0]).points
    side = 4.0 / 2**level
    x, y = points[:, 0] / side, points[:, 1] / side
    upper = (x % 1.0) + (y % 1.0) > 1.0
    parts = set(zip(np.floor(x).tolist(), np.floor(y).tolist(), upper.tolist(), strict=True))
    assert len(parts) == 4**level


def test_faces_do_not_depend_on_each_other(scene):
    every, one = sample_faces(scene, 7, seed=3), sample_faces(scene, 7, seed=3, faces=[4])
    assert (every.points[every.triangles == 4] == one.points).all()
    assert (sample_faces(scene, 7, seed=4, faces=[4]).points != one.points).any()


def test_mean_is_unbiased_and_within_the_stated_deviation():
    """The part of a triangle beyond a straight edge, (1 - x)^2 of it: the mean of 4,000 faces is within four standard deviations of it."""
    count, per, at = 4000, 16, 0.37
    strip = gs.Mesh(np.tile(PATCH.positions[:3], (count, 1)), np.arange(3 * count).reshape(-1, 3))
    share = (sample_faces(gs.Scene([strip]), per).points[:, 0] > 4.0 * at).reshape(count, per).mean(axis=1)
    assert abs(share.mean() - (1.0 - at) ** 2) < 4.0 * share.std() / np.sqrt(count)
    assert share.std() < 0.71 * per**-0.75


@pytest.mark.parametrize("faces", [[3], [-1], [7], [0.5], [[0]]])
def test_faces_out_of_range_raise(scene, faces):
    with pytest.raises(gs.SettingsError, match="faces must be"):
        sample_faces(scene, 1, faces=faces)


@pytest.mark.parametrize("number", [0, 1.5, "many"])
def test_bad_number_of_points_raises(scene, number):
    with pytest.raises(gs.SettingsError, match="per_face must be"):
        sample_faces(scene, number)
