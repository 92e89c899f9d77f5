"""A pose that is right, one that is wrong, and an object of another kind."""

from __future__ import annotations

from core.sim3 import Sim3
from core.verification import agreement

from .conftest import PaintedObject


def test_the_right_pose_of_the_right_object_agrees_most(painted: PaintedObject, moved: Sim3) -> None:
    reference, target = painted.reference(6), painted.encode(6, moved)
    right = agreement(reference, target, moved, None)
    turned = agreement(reference, target, Sim3(moved.scale, -moved.rotation @ [[1, 0, 0], [0, -1, 0], [0, 0, 1]], moved.translation), None)
    other = agreement(reference, PaintedObject(seed=5).encode(6, moved), moved, None)
    assert right > 0.8
    assert max(turned, other) < 0.7 * right
