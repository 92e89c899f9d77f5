"""Camera poses look at a point from all sides, and are told apart by angle about it."""

from __future__ import annotations

import numpy as np
import pytest

from core.camera_poses import (
    ELEVATION_RANGE_DEG,
    angles_about_deg,
    hemisphere,
    look_at,
    nearest_view,
    short_tour,
    waypoints,
)
from core.errors import InvalidInput
from core.views import Camera, FloatArray

from .conftest import K

UP = np.array([0.0, 0.6, 0.8])
CENTER = np.array([1.0, 2.0, 3.0])


def test_every_viewpoint_looks_at_the_centre_from_above() -> None:
    poses = hemisphere(CENTER, UP, 2.0, 10)
    for pose in poses:
        Camera(K, pose)
        to_center = CENTER - pose[:3, 3]
        assert np.allclose(pose[:3, 2] * 2.0, to_center)
        assert -to_center @ UP > 0.4
        assert abs(pose[:3, 0] @ UP) < 1e-9


def test_viewpoints_climb_evenly_within_the_range_of_elevations() -> None:
    heights = hemisphere(np.zeros(3), np.array([0.0, 0, 1]), 1.0, 10)[:, 2, 3]
    low, high = np.sin(np.radians(ELEVATION_RANGE_DEG))
    assert heights == pytest.approx(np.linspace(low, high, 21)[1::2])


def test_viewpoints_go_all_around() -> None:
    offsets = hemisphere(np.zeros(3), np.array([0.0, 0, 1]), 1.0, 10)[:, :3, 3]
    azimuth = np.sort(np.degrees(np.arctan2(offsets[:, 1], offsets[:, 0])))
    assert np.diff(np.append(azimuth, azimuth[0] + 360)).max() < 60


def way_m(positions: FloatArray, start: FloatArray) -> float:
    """Length of the way from a start past positions, shape (n, 3), in their order."""
    return float(np.linalg.norm(np.diff(np.vstack([start, positions]), axis=0), axis=1).sum())


def test_every_waypoint_looks_at_the_centre_from_above_the_support() -> None:
    poses = waypoints(CENTER, UP, 2.0, 200, seed=1)
    low, high = np.sin(np.radians(ELEVATION_RANGE_DEG))
    heights = (poses[:, :3, 3] - CENTER) @ UP / 2.0
    assert np.allclose(poses[:, :3, 3] + 2.0 * poses[:, :3, 2], CENTER)
    assert np.allclose(poses[:, :3, 0] @ UP, 0)
    assert low - 1e-9 <= heights.min() < low + 0.05
    assert high - 0.05 < heights.max() <= high + 1e-9
    assert heights.mean() == pytest.approx((low + high) / 2, abs=0.05)
    sideways = (poses[:, :3, 3] - CENTER) / 2.0 - heights[:, None] * UP
    assert np.linalg.norm(sideways.mean(axis=0)) < 0.15  # from all around
    for pose in poses[:5]:
        Camera(K, pose)


def test_waypoints_depend_on_the_seed_and_their_order_on_where_the_camera_is() -> None:
    here = look_at(CENTER + np.array([2.0, 0, 1]), CENTER, UP)
    drawn, again, others, from_here = (waypoints(CENTER, UP, 2.0, 6, *rest) for rest in ((3,), (3,), (4,), (3, here)))
    assert np.array_equal(drawn, again)
    assert not np.allclose(drawn, others)
    assert {pose.tobytes() for pose in drawn} == {pose.tobytes() for pose in from_here}
    distances = np.linalg.norm(from_here[:, :3, 3] - here[:3, 3], axis=1)
    assert distances.argmin() == 0


def test_a_tour_goes_on_to_the_nearest_place_left() -> None:
    places = np.array([[5.0, 0, 0], [1, 0, 0], [-2, 0, 0], [2, 0, 0]])
    assert short_tour(places, np.zeros(3)) == [1, 3, 0, 2]


def test_the_tour_is_no_longer_than_the_way_as_drawn() -> None:
    chance = np.random.default_rng(0)
    for _ in range(50):
        places, start = chance.normal(size=(12, 3)), chance.normal(size=3)
        assert way_m(places[short_tour(places, start)], start) <= way_m(places, start)


def test_angles_are_about_the_point_however_far_the_cameras_are() -> None:
    here = CENTER + np.array([[1.0, 0, 0], [0, 5, 0]])
    there = CENTER + np.array([[2.0, 0, 0], [0, 0, 3], [-1, 0, 0], [1, 1, 0]])
    assert np.allclose(angles_about_deg(here, there, CENTER), [[0, 90, 180, 45], [90, 90, 90, 45]])


def test_the_nearest_view_is_by_angle_not_distance() -> None:
    candidates = hemisphere(CENTER, UP, 3.0, 8)
    wanted = look_at(CENTER + (candidates[5][:3, 3] - CENTER) * 0.3, CENTER, UP)
    assert nearest_view(wanted, candidates, CENTER) == (5, pytest.approx(0, abs=1e-4))


def test_looking_straight_down_has_no_roll() -> None:
    with pytest.raises(InvalidInput, match="roll"):
        look_at(CENTER + UP, CENTER, UP)
