"""Recorded worlds answer with what was recorded nearest to the pose that is asked for."""

from __future__ import annotations

import numpy as np
import pytest

from clients.datasets.folders import Sequence, load_burst
from clients.datasets.viewpoints import aim_point
from clients.simulator.replay import ReplayWorld


def test_a_recorded_pose_is_answered_exactly(recordings: list[Sequence]) -> None:
    world = ReplayWorld(recordings[0])
    recorded = load_burst(recordings[0]).views[5]
    assert recorded.camera is not None
    view = world.capture(recorded.camera.world_from_camera)
    np.testing.assert_array_equal(view.rgb, recorded.rgb)
    assert world.offsets_deg == [pytest.approx(0, abs=1e-3)]


def test_a_requested_pose_is_answered_by_the_nearest_and_says_how_far_off(recordings: list[Sequence]) -> None:
    world = ReplayWorld(recordings[0])
    cameras = load_burst(recordings[0]).cameras
    center = aim_point(cameras)
    turned = np.eye(4)
    axis = cameras[5].world_from_camera[:3, 1]
    cross = np.cross(np.eye(3), axis)
    angle = np.radians(2)
    rotation = np.eye(3) + np.sin(angle) * cross.T + (1 - np.cos(angle)) * cross @ cross
    turned[:3, :3] = rotation @ cameras[5].world_from_camera[:3, :3]
    turned[:3, 3] = center + rotation @ (cameras[5].world_from_camera[:3, 3] - center)
    view = world.capture(turned)
    assert view.camera is not None
    np.testing.assert_array_equal(view.camera.world_from_camera, cameras[5].world_from_camera)
    assert world.offsets_deg[0] == pytest.approx(2, abs=0.2)


def test_each_view_is_brought_once_before_any_again(recordings: list[Sequence]) -> None:
    world = ReplayWorld(recordings[0])
    cameras = load_burst(recordings[0]).cameras
    pose = cameras[0].world_from_camera
    brought = [world.capture(pose) for _ in range(len(cameras) + 1)]
    assert len({view.rgb.tobytes() for view in brought}) == len(cameras)
    assert world.offsets_deg[-1] == pytest.approx(0, abs=1e-3)


def test_a_robot_looks_first_from_as_many_recorded_poses_as_it_wants(recordings: list[Sequence]) -> None:
    recorded = {camera.world_from_camera.tobytes() for camera in load_burst(recordings[0]).cameras}
    looked_from = {pose.tobytes() for pose in ReplayWorld(recordings[0]).viewpoints(4, seed=0)}
    assert len(looked_from) == 4
    assert looked_from < recorded
