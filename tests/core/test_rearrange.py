"""Rearrangement from known answers: the same object, a smaller one, a symmetric one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.boxes import OrientedBox
from core.errors import InvalidInput
from core.rearrange import rearrange
from core.sim3 import Sim3

UP = np.array([0.0, 0.0, 1.0])
NONE = np.empty((0, 3, 3))


def about_z(angle_deg: float) -> np.ndarray:
    return Rotation.from_euler("z", angle_deg, degrees=True).as_matrix()


@pytest.fixture
def box() -> OrientedBox:
    """20 × 10 × 30 cm, standing on the plane z = 1 of the scan's world, its middle beside the world's origin."""
    placed = np.eye(4)
    placed[:3, 3] = [0.4, 0.2, 1.15]
    return OrientedBox(placed, np.array([0.2, 0.1, 0.3]))


@pytest.fixture
def goal() -> Sim3:
    """The reference itself, turned by 90° about the vertical and put on the plane z = 0."""
    return Sim3(1.0, about_z(90), np.array([1.0, 0.0, -1.0]))


def test_the_same_object_gets_the_motion_it_was_moved_by(box: OrientedBox, goal: Sim3) -> None:
    moved_by = Sim3(1.0, Rotation.from_rotvec([0.3, -0.5, 1.1]).as_matrix(), np.array([0.2, 0.5, -0.1]))
    for anchor in ("center", "base"):
        motion = rearrange(box, NONE, goal, moved_by.inverse() @ goal, anchor=anchor, up=UP)
        assert np.allclose(motion.goal_from_current, moved_by.as_matrix())
        assert motion.angle_deg == pytest.approx(np.degrees(np.linalg.norm([0.3, -0.5, 1.1])))


def test_centres_meet_whatever_the_size(box: OrientedBox, goal: Sim3) -> None:
    current = Sim3(0.5, about_z(30), np.array([0.0, 0.3, 0.0]))
    motion = rearrange(box, NONE, goal, current)
    middle = box.world_from_object[:3, 3]
    after = motion.goal_from_current[:3, :3] @ current.apply(middle) + motion.goal_from_current[:3, 3]
    assert np.allclose(after, goal.apply(middle))
    assert motion.angle_deg == pytest.approx(60)
    assert motion.distance_m == pytest.approx(np.linalg.norm(goal.apply(middle) - current.apply(middle)))


@pytest.mark.parametrize("lying", [False, True])
def test_a_smaller_object_is_put_on_the_same_support(box: OrientedBox, goal: Sim3, lying: bool) -> None:
    tilt = Rotation.from_euler("x", 90 if lying else 0, degrees=True).as_matrix()
    current = Sim3(0.5, tilt @ about_z(30), np.array([0.0, 0.3, 0.4]))
    motion = rearrange(box, NONE, goal, current, anchor="base", up=UP)
    corners = box.moved_by(current).corners() @ motion.goal_from_current[:3, :3].T + motion.goal_from_current[:3, 3]
    assert corners[:, 2].min() == pytest.approx(0)
    assert corners[:, 2].max() == pytest.approx(0.15)
    assert np.allclose(corners[:, :2].mean(axis=0), goal.apply(box.world_from_object[:3, 3])[:2])


def test_a_symmetric_object_turns_the_short_way(box: OrientedBox, goal: Sim3) -> None:
    half_turn = about_z(180)[None]
    current = Sim3(1.0, about_z(280), np.zeros(3))
    plain, symmetric = (rearrange(box, each, goal, current, anchor="base", up=UP) for each in (NONE, half_turn))
    assert (plain.angle_deg, plain.symmetric) == (pytest.approx(170), False)
    assert (symmetric.angle_deg, symmetric.symmetric) == (pytest.approx(10), True)
    ends = [
        np.sort(box.moved_by(current).corners() @ motion.goal_from_current[:3, :3].T + motion.goal_from_current[:3, 3], axis=0)
        for motion in (plain, symmetric)
    ]
    assert np.allclose(*ends)


def test_a_base_needs_up(box: OrientedBox, goal: Sim3) -> None:
    with pytest.raises(InvalidInput, match="up"):
        rearrange(box, NONE, goal, goal, anchor="base")
