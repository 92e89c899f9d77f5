"""The dense score prefers the truth, and refinement finds it from nearby."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from core.dense import DenseAgreement, DenseConfig
from core.descriptors import unit
from core.encode import EncodedBurst, EncodedView
from core.errors import NoPose
from core.estimators.batched import Sim3Batch, umeyama_batch
from core.hypotheses import distinct
from core.pose import VARIANTS, PoseEstimator
from core.sim3 import Sim3, rotation_angle_deg
from core.surface import Surface

from .conftest import PaintedObject


def batch(*transforms: Sim3) -> Sim3Batch:
    return Sim3Batch.of(transforms)


def turned(degrees: float) -> Sim3:
    return Sim3(1.0, Rotation.from_euler("z", degrees, degrees=True).as_matrix(), np.zeros(3))


@pytest.fixture
def agreement(painted: PaintedObject, moved: Sim3) -> DenseAgreement:
    sides = [painted.encode(5).views, painted.encode(4, moved).views]
    described = [[unit(view.descriptors) for view in views] for views in sides]
    return DenseAgreement(Surface(sides[0]), Surface(sides[1]), (described[0], described[1]), DenseConfig(), seed=0)


def test_the_truth_scores_above_turns_of_it(agreement: DenseAgreement, moved: Sim3) -> None:
    scores = agreement.score(batch(moved, moved @ turned(20), moved @ turned(180)))
    assert scores.argmax() == 0
    assert scores.min() >= 0
    assert scores.max() <= 1


def test_refinement_ends_nearer_the_truth(agreement: DenseAgreement, moved: Sim3) -> None:
    start = moved @ turned(12)
    refined = agreement.refine(batch(start))[0]
    assert rotation_angle_deg(refined.rotation, moved.rotation) < 3


def test_distinct_keeps_the_better_of_two_alike() -> None:
    transforms = batch(turned(0), turned(5), turned(90), turned(180))
    assert distinct(transforms, torch.tensor([0.4, 0.5, 0.1, 0.3]), 12, 3) == [1, 3, 2]


def test_a_twin_after_a_symmetry_of_the_reference_is_not_distinct(moved: Sim3) -> None:
    turned = [moved @ Sim3(1.0, Rotation.from_euler("z", angle, degrees=True).as_matrix(), np.zeros(3)) for angle in (0, 170, 90, 265, 45)]
    scores = torch.tensor([1.0, 0.9, 0.8, 0.7, 0.6])
    half_turn = Rotation.from_euler("z", 180, degrees=True).as_matrix()[None]
    assert distinct(batch(*turned), scores, 30, 5, half_turn) == [0, 2, 4]
    assert distinct(batch(*turned), scores, 30, 5) == [0, 1, 2, 3, 4]


def test_a_batch_of_fits_is_each_fit_alone(moved: Sim3) -> None:
    points = torch.from_numpy(np.random.default_rng(0).normal(size=(3, 5, 3)))
    aims = torch.from_numpy(np.stack([moved.apply(each.numpy()) for each in points]))
    aims[2] = points[2, :1]
    fitted, determined = umeyama_batch(points, aims)
    assert determined.tolist() == [True, True, False]
    assert np.allclose(fitted[1].as_matrix(), moved.as_matrix())


def test_an_object_that_looks_the_same_from_behind_has_a_rival(painted: PaintedObject, moved: Sim3) -> None:
    painted.points = np.concatenate([painted.points, turned(180).apply(painted.points)])
    painted.descriptors = np.concatenate([painted.descriptors, painted.descriptors])
    estimate = PoseEstimator(VARIANTS["best"]).estimate(painted.reference(6), painted.encode(4, moved))
    rival = estimate.alternatives[0]
    assert estimate.score is not None
    assert estimate.score * 0.8 < rival.score <= estimate.score
    assert rotation_angle_deg(rival.target_from_reference.rotation, estimate.target_from_reference.rotation) > 170


def test_best_without_a_match_is_no_pose(painted: PaintedObject) -> None:
    target = painted.encode(2)
    opposite = EncodedBurst(tuple(replace(view, descriptors=np.zeros_like(view.descriptors)) for view in target.views), target.fingerprint)
    reference = painted.reference(4)
    zero_mean = replace(reference.basis, mean=np.zeros_like(reference.basis.mean))
    with pytest.raises(NoPose, match="no view pair"):
        PoseEstimator(VARIANTS["best"]).estimate(replace(reference, basis=zero_mean), opposite)


def plate(moved: Sim3, views: int) -> tuple[EncodedView, ...]:
    """A thin plate seen from above, which looks the same when it is turned over about its long axis."""
    painted = PaintedObject(points=2500)
    painted.points[:, 2] *= 0.01
    mirrored = np.abs(painted.points)
    painted.descriptors = np.sin(mirrored @ np.random.default_rng(3).normal(size=(3, 48)) * 12).astype(np.float32)
    return painted.encode(views, moved).views


def test_a_plate_face_down_does_not_lie_on_one_face_up(moved: Sim3) -> None:
    sides = [plate(Sim3.identity(), 6), plate(moved, 5)]
    described = [[unit(view.descriptors) for view in views] for views in sides]
    over = Sim3(1.0, Rotation.from_euler("x", 180, degrees=True).as_matrix(), np.zeros(3))
    right, wrong = DenseAgreement(Surface(sides[0]), Surface(sides[1]), (described[0], described[1]), DenseConfig(), seed=0).score(
        batch(moved, moved @ over)
    )
    assert right > 0.5
    assert wrong < 0.1 * right


def test_normals_point_to_the_camera() -> None:
    normals = Surface(plate(Sim3.identity(), 6)).normals
    np.testing.assert_allclose(normals[:, 2], 1.0, atol=0.02)
