"""Symmetries of bodies whose paint and shape are known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.encode import EncodedBurst
from core.pose import PoseConfig, PoseEstimator
from core.reference import Reference, build_reference
from core.sim3 import Sim3, rotation_angle_deg
from core.views import FloatArray

from .conftest import PaintedObject

ROUND = np.array([0.14, 0.14, 0.18])
LONG = np.array([0.2, 0.12, 0.1])
Paint = Callable[[FloatArray], FloatArray]


def by_place(points: FloatArray) -> FloatArray:
    return points


def by_height(points: FloatArray) -> FloatArray:
    return points * np.array([0, 0, 1.0])


def repeated(order: int) -> Paint:
    """The same after every turn of this order about z."""

    def paint(points: FloatArray) -> FloatArray:
        angle, radius = order * np.arctan2(points[:, 1], points[:, 0]), np.linalg.norm(points[:, :2], axis=1)
        return np.stack([radius * np.cos(angle), radius * np.sin(angle), points[:, 2]], axis=1)

    return paint


def body(half_axes: FloatArray, paint: Paint, *, knob: bool = False) -> PaintedObject:
    """An ellipsoid, with a knob at its side if asked for."""
    painted = PaintedObject()
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(8000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    points = directions * half_axes
    if knob:
        points = np.concatenate([points, directions[:800] * 0.05 + np.array([half_axes[0] + 0.03, 0, 0])])
    waves = rng.normal(size=(3, 48)) * 12
    painted.points = points
    painted.descriptors = np.sin(paint(points) @ waves + rng.uniform(0, 6.28, 48)).astype(np.float32)
    return painted


def scanned(painted: PaintedObject, world_from_object: Sim3, views: int = 12) -> Reference:
    return build_reference(painted.encode(views, world_from_object))


def about_up(reference: Reference, world_from_object: Sim3) -> list[int]:
    """Angles of the symmetries, degrees from 0 to 360, all of which must be about the object's z axis to within 3°."""
    vectors = Rotation.from_matrix(reference.symmetries).as_rotvec() if len(reference.symmetries) else np.zeros((0, 3))
    signed = vectors @ world_from_object.rotation[:, 2]
    assert (np.abs(signed) >= np.cos(np.radians(3)) * np.linalg.norm(vectors, axis=1)).all()
    return sorted(round(float(np.degrees(angle))) % 360 for angle in signed)


@pytest.mark.parametrize(
    ("half_axes", "paint", "angles"),
    [
        (LONG, by_place, []),
        (ROUND, by_place, []),
        (LONG, repeated(2), [180]),
        (ROUND, repeated(2), [180]),
        (ROUND, repeated(3), [120, 240]),
        (ROUND, repeated(4), [90, 180, 270]),
        (ROUND, repeated(6), [60, 120, 180, 240, 300]),
        (LONG, by_height, [180]),
        (ROUND, by_height, list(range(30, 360, 30))),
    ],
)
def test_shape_and_paint_must_both_be_symmetric(half_axes: FloatArray, paint: Paint, angles: list[int], moved: Sim3) -> None:
    assert about_up(scanned(body(half_axes, paint), moved), moved) == angles


def test_a_knob_breaks_the_symmetry(moved: Sim3) -> None:
    assert not len(scanned(body(ROUND, by_height, knob=True), moved).symmetries)


def test_nothing_is_claimed_of_a_side_that_was_not_seen(moved: Sim3) -> None:
    encoded = body(ROUND, by_height).encode(40, moved)
    object_from_world = moved.inverse()
    from_front = [view for view in encoded.views if view.camera and object_from_world.apply(view.camera.world_from_camera[:3, 3])[0] > 0.5]
    assert len(from_front) > 8
    assert not len(build_reference(EncodedBurst(tuple(from_front), encoded.fingerprint)).symmetries)


def test_the_same_scan_gives_the_same_symmetries(moved: Sim3) -> None:
    first, second = (scanned(body(ROUND, repeated(2)), moved).symmetries for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_a_pose_of_a_symmetric_object_is_right_but_for_its_symmetry(moved: Sim3) -> None:
    painted = body(LONG, repeated(2))
    reference = scanned(painted, Sim3.identity(), 10)
    estimate = PoseEstimator(PoseConfig.named("best")).estimate(reference, painted.encode(8, moved))
    meant = moved.rotation @ np.concatenate([np.eye(3)[None], reference.symmetries])
    assert rotation_angle_deg(estimate.target_from_reference.rotation, meant).min() < 5
    for other in estimate.alternatives:
        assert rotation_angle_deg(other.target_from_reference.rotation, meant).min() > 20
