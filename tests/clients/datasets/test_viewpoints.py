"""Where cameras aim, and which of them are far apart."""

from __future__ import annotations

import numpy as np

from clients.datasets.viewpoints import aim_point, spread
from core.camera_poses import hemisphere
from core.views import Camera

K = np.array([[100.0, 0, 50], [0, 100, 50], [0, 0, 1]])
CENTER_M = np.array([1.0, -2.0, 0.5])
CAMERAS = [Camera(K, pose) for pose in hemisphere(CENTER_M, np.array([0.0, 0.6, 0.8]), 0.7, 12)]


def test_cameras_aim_at_the_point_they_look_at() -> None:
    np.testing.assert_allclose(aim_point(CAMERAS), CENTER_M, atol=1e-9)


def test_spread_views_are_farther_apart_than_neighbours() -> None:
    chosen = spread(CAMERAS, 4, first=3)
    assert 3 in chosen
    assert len(set(chosen)) == 4

    def closest_deg(indices: list[int]) -> float:
        towards = np.stack([CAMERAS[index].world_from_camera[:3, 2] for index in indices])
        return float(np.degrees(np.arccos((towards @ towards.T)[np.triu_indices(len(indices), 1)].max())))

    assert closest_deg(chosen) > 1.5 * closest_deg(list(range(12)))


def test_spread_takes_all_where_there_are_no_more() -> None:
    assert spread(CAMERAS[:3], 8) == [0, 1, 2]
