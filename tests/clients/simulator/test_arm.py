"""The arm: what it reaches, what it does instead, and what that takes."""

from __future__ import annotations

import numpy as np
import pytest

from clients.simulator.arm import FREE, UP, Arm, ArmConfig, Limits
from clients.simulator.world import WorldObject
from core.camera_poses import hemisphere, look_at
from core.views import Camera, FloatArray, View

CENTER_M = np.array([0.0, 0.0, 0.08])
K = np.array([[50.0, 0, 20], [0, 50, 20], [0, 0, 1]])


class EmptyWorld:
    """Grey, from everywhere."""

    objects: list[WorldObject] = []
    center_m = CENTER_M
    captured = 0
    """Views taken."""

    def viewpoints(self, count: int, seed: int) -> list[FloatArray]:
        """All around."""
        return list(hemisphere(CENTER_M, UP, 0.58, count))

    def capture(self, world_from_camera: FloatArray) -> View:
        """From exactly there."""
        self.captured += 1
        return View(np.full((40, 40, 3), 128, np.uint8), camera=Camera(K, world_from_camera))


def pose(azimuth_deg: float, elevation_deg: float, distance: float = 0.58) -> FloatArray:
    azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
    towards = np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    return look_at(CENTER_M + distance * towards, CENTER_M, UP)


@pytest.mark.parametrize(
    ("place", "says"),
    [
        (pose(180, 60), None),
        (pose(90, 30), None),
        (pose(0, 20), "reaches 0.95 m"),
        (look_at(np.array([-0.5, 0.0, 0.4]), CENTER_M, UP), "cannot fold"),
        (look_at(np.array([-0.1, 0.4, 0.05]), CENTER_M, UP), "are kept clear"),
        (look_at(np.array([0.2, 0.0, 0.33]), np.array([-0.62, 0.01, 0.33]), UP), "the wrist would bend"),
    ],
)
def test_limits_say_what_is_out_of_reach_and_why(place: FloatArray, says: str | None) -> None:
    reason = Arm(EmptyWorld()).cannot_reach(place)
    assert (reason is None) if says is None else (reason is not None and says in reason)


def test_an_unreachable_viewpoint_is_answered_from_as_near_as_can_be() -> None:
    arm = Arm(EmptyWorld())
    wanted = pose(0, 25)
    near = arm.nearest(wanted, CENTER_M)
    assert near is not None
    assert arm.cannot_reach(near) is None
    (view,) = arm.look_around([wanted], CENTER_M)
    assert view.camera is not None
    np.testing.assert_array_equal(view.camera.world_from_camera, near)
    assert 5 < arm.offsets_deg[0] < 50
    aim = near[:3, 3] + near[:3, 2] * np.linalg.norm(near[:3, 3] - CENTER_M)
    np.testing.assert_allclose(aim, CENTER_M, atol=1e-9)


def test_what_nothing_comes_near_to_is_refused() -> None:
    arm = Arm(EmptyWorld(), ArmConfig(limits=Limits(reach_m=(0.0, 0.1))))
    assert list(arm.look_around([pose(0, 25), pose(90, 25)], CENTER_M)) == []
    assert arm.refused == 2


def test_no_two_views_are_taken_from_one_place() -> None:
    arm = Arm(EmptyWorld())
    assert len(list(arm.look_around([pose(90, 30), pose(92, 30), pose(180, 30)], CENTER_M))) == 2


def test_a_free_camera_goes_anywhere() -> None:
    arm = Arm(EmptyWorld(), FREE)
    assert len(arm.glance(12, seed=0)) == 12
    assert max(arm.offsets_deg) == pytest.approx(0, abs=1e-3)


def test_some_of_a_hemisphere_is_out_of_the_arms_reach_but_most_views_arrive() -> None:
    arm = Arm(EmptyWorld())
    out = [each for each in EmptyWorld().viewpoints(20, 0) if arm.cannot_reach(each)]
    assert 1 <= len(out) <= 10
    assert len(arm.glance(20, seed=0)) >= 12


def test_moving_takes_simulated_time_and_the_shorter_way_is_taken() -> None:
    config = ArmConfig(limits=None, speed_m_s=0.5, turn_deg_s=1e9, settle_s=1.0)
    arm = Arm(EmptyWorld(), config)
    places = [look_at(np.array([x, 0.0, 1.0]), np.array([x, 1.0, 0.5]), UP) for x in (0.0, 2.0, 1.0)]
    taken = [view.camera.world_from_camera[0, 3] for view in arm.look_around(places, np.array([0.5, 5.0, 0.0])) if view.camera]
    assert taken == [0.0, 1.0, 2.0]
    assert arm.clock_s == pytest.approx(3 * 1.0 + 2 / 0.5)
    arm.carry(distance_m=1.0, angle_deg=0.0)
    assert arm.clock_s == pytest.approx(7.0 + 2 * config.grip_s + 2.0)
