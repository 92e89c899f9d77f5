"""The pose a moment later, from the last one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.encode import EncodedBurst
from core.errors import InvalidInput
from core.reference import Reference
from core.sim3 import Sim3, rotation_angle_deg
from core.warm import Settled, WarmConfig, follow, nearest_views, settle

from .conftest import PaintedObject, blind

CONFIG = WarmConfig()


@pytest.fixture
def reference(painted: PaintedObject) -> Reference:
    return painted.reference(8)


def turned(pose: Sim3, angle_deg: float, shift_m: float) -> Sim3:
    """Turned about the object's middle, which the painted object has at its origin, and shifted."""
    axis = np.array([0.3, 0.5, -0.81])
    rotation = Rotation.from_rotvec(np.radians(angle_deg) * axis / np.linalg.norm(axis)).as_matrix() @ pose.rotation
    return Sim3(pose.scale, rotation, pose.translation + shift_m * np.array([0.6, 0.0, 0.8]))


@pytest.mark.parametrize(("angle_deg", "shift_m"), [(0, 0), (5, 0.01), (12, 0.03)])
def test_an_object_that_moved_a_little_is_found_from_its_last_pose(
    angle_deg: float, shift_m: float, painted: PaintedObject, reference: Reference, moved: Sim3
) -> None:
    before = settle(reference, painted.encode(4, moved), moved, CONFIG, seed=0)
    now = turned(moved, angle_deg, shift_m)
    found = follow(reference, painted.encode(4, now), before, CONFIG, seed=0)
    assert rotation_angle_deg(found.pose.rotation, now.rotation) < 3
    assert np.linalg.norm(found.pose.translation - now.translation) < 0.02
    assert found.score == before.score


@pytest.mark.parametrize(("angle_deg", "shift_m"), [(90, 0), (180, 0), (0, 0.8)])
def test_an_object_that_jumped_is_sought_anew(
    angle_deg: float, shift_m: float, painted: PaintedObject, reference: Reference, moved: Sim3
) -> None:
    before = settle(reference, painted.encode(4, moved), moved, CONFIG, seed=0)
    assert follow(reference, painted.encode(4, turned(moved, angle_deg, shift_m)), before, CONFIG, seed=0) is None


def test_another_object_is_not_followed(reference: Reference, painted: PaintedObject, moved: Sim3) -> None:
    before = settle(reference, painted.encode(4, moved), moved, CONFIG, seed=0)
    assert follow(reference, PaintedObject(seed=5).encode(4, moved), before, CONFIG, seed=0) is None


def test_without_depth_there_is_nothing_to_follow(reference: Reference, painted: PaintedObject, moved: Sim3) -> None:
    target = blind(painted.encode(3, moved))
    assert settle(reference, target, moved, CONFIG, seed=0) is None
    assert follow(reference, target, Settled(moved, 0.5), CONFIG, seed=0) is None


def test_only_reference_views_from_about_there_are_looked_at(painted: PaintedObject, reference: Reference, moved: Sim3) -> None:
    target = painted.encode(8, moved)  # from the very same sides as the reference
    for view in range(8):
        assert nearest_views(reference, target.select([view]), moved, 1) == [view]
    assert nearest_views(reference, target, moved, 1) == list(range(8))
    assert len(nearest_views(reference, target.select([0, 1]), moved, 2)) <= 4


def test_tokens_of_another_backbone_are_refused(painted: PaintedObject, reference: Reference, moved: Sim3) -> None:
    other = EncodedBurst(painted.encode(3, moved).views, "another")
    with pytest.raises(InvalidInput, match="another"):
        follow(reference, other, Settled(moved, 0.5), CONFIG, seed=0)
