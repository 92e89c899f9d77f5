"""Viewpoints on the hemisphere look at the object from all sides."""

from __future__ import annotations

import numpy as np
import pytest

from core.errors import InvalidInput
from core.scan import hemisphere, infer_up, look_at, nearest_view, request_scan
from core.sim3 import Sim3
from core.views import Camera

from .conftest import K, PaintedObject

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


def test_viewpoints_go_all_around() -> None:
    offsets = hemisphere(np.zeros(3), np.array([0.0, 0, 1]), 1.0, 10)[:, :3, 3]
    azimuth = np.sort(np.degrees(np.arctan2(offsets[:, 1], offsets[:, 0])))
    assert np.diff(np.append(azimuth, azimuth[0] + 360)).max() < 60


def test_up_is_inferred_from_level_cameras(moved: Sim3, painted: PaintedObject) -> None:
    cameras = [view.camera for view in painted.encode(5, moved).views if view.camera]
    assert infer_up(cameras) @ moved.rotation[:, 2] > 0.999


def test_a_scan_is_requested_about_the_object(moved: Sim3, painted: PaintedObject) -> None:
    request = request_scan(painted.encode(4, moved), 12)
    assert request.world_from_camera.shape == (12, 4, 4)
    assert np.linalg.norm(request.center_m - moved.translation) < 0.1
    assert np.isclose(request.radius_m, moved.scale, rtol=0.1)


def test_the_nearest_view_is_by_angle_not_distance() -> None:
    candidates = hemisphere(CENTER, UP, 3.0, 8)
    wanted = look_at(CENTER + (candidates[5][:3, 3] - CENTER) * 0.3, CENTER, UP)
    assert nearest_view(wanted, candidates, CENTER) == (5, pytest.approx(0, abs=1e-4))


def test_looking_straight_down_has_no_roll() -> None:
    with pytest.raises(InvalidInput, match="roll"):
        look_at(CENTER + UP, CENTER, UP)
