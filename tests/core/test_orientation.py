"""Without any depth: a rotation and a direction, and no scale at all."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from core.errors import InvalidInput, NoPose
from core.orientation import Appearance, Orientation, OrientationConfig, estimate_orientation
from core.sim3 import Sim3, rotation_angle_deg

from .conftest import PaintedObject, blind, first_patches


def test_rotation_and_direction_follow_without_depth(painted: PaintedObject, moved: Sim3) -> None:
    scanned, target = blind(painted.encode(12)), blind(painted.encode(6, moved))
    found = estimate_orientation(Appearance.of(scanned), target)
    assert rotation_angle_deg(found.rotation, moved.rotation) < 10
    reference_view, target_view = found.pairs[0]
    stands = moved.apply(scanned.views[reference_view].camera.world_from_camera[:3, 3])
    way = stands - target.views[target_view].camera.world_from_camera[:3, 3]
    assert np.isclose(np.linalg.norm(found.direction), 1)
    assert way @ found.direction / np.linalg.norm(way) > 0.9


def test_there_is_no_scale_to_be_read() -> None:
    assert not {"scale", "translation", "target_from_reference"} & {field.name for field in fields(Orientation)}


def test_depth_is_never_looked_at(painted: PaintedObject, moved: Sim3) -> None:
    scanned, target = painted.encode(6), painted.encode(4, moved)
    seeing = estimate_orientation(Appearance.of(scanned), target)
    not_seeing = estimate_orientation(Appearance.of(blind(scanned)), blind(target))
    assert np.array_equal(seeing.rotation, not_seeing.rotation)
    assert np.array_equal(seeing.direction, not_seeing.direction)


def test_the_seed_decides_everything(painted: PaintedObject, moved: Sim3) -> None:
    appearance, target = Appearance.of(painted.encode(6)), painted.encode(3, moved)
    first, again = (estimate_orientation(appearance, target, seed=3) for _ in range(2))
    assert np.array_equal(first.rotation, again.rotation)


def test_too_few_correspondences_are_no_pose(painted: PaintedObject) -> None:
    few = first_patches(painted.encode(3), 3)
    with pytest.raises(NoPose, match="essential"):
        estimate_orientation(Appearance.of(painted.encode(4)), few, OrientationConfig(correspondences=3))


def test_distance_in_metres_is_refused_as_a_way_to_match() -> None:
    with pytest.raises(InvalidInput, match="cyclical-3d"):
        OrientationConfig(method="cyclical-3d")


def test_tokens_of_another_backbone_are_refused(painted: PaintedObject) -> None:
    with pytest.raises(InvalidInput, match="backbone"):
        estimate_orientation(Appearance.of(painted.encode(3)), replace(painted.encode(2), fingerprint="other"))
