"""The dense score prefers the truth, and refinement finds it from nearby."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.dense import DenseAgreement, DenseConfig
from core.descriptors import unit
from core.encode import EncodedView
from core.estimators.batched import Sim3Batch
from core.sim3 import Sim3, rotation_angle_deg
from core.surface import Surface

from .conftest import PaintedObject, turned


def agreement_of(reference: Sequence[EncodedView], target: Sequence[EncodedView]) -> DenseAgreement:
    """By the descriptors as they are."""
    described = [[unit(view.descriptors) for view in views] for views in (reference, target)]
    return DenseAgreement(Surface(reference), Surface(target), (described[0], described[1]), DenseConfig(), seed=0)


@pytest.fixture
def agreement(painted: PaintedObject, moved: Sim3) -> DenseAgreement:
    return agreement_of(painted.encode(5).views, painted.encode(4, moved).views)


def test_the_truth_scores_above_turns_of_it(agreement: DenseAgreement, moved: Sim3) -> None:
    scores = agreement.score(Sim3Batch.of([moved, moved @ turned(20), moved @ turned(180)]))
    assert scores.argmax() == 0
    assert scores.min() >= 0
    assert scores.max() <= 1


def test_refinement_ends_nearer_the_truth(agreement: DenseAgreement, moved: Sim3) -> None:
    start = moved @ turned(12)
    refined = agreement.refine(Sim3Batch.of([start]))[0]
    assert rotation_angle_deg(refined.rotation, moved.rotation) < 3


def plate(moved: Sim3, views: int) -> tuple[EncodedView, ...]:
    """A thin plate seen from above, which looks the same when it is turned over about its long axis."""
    painted = PaintedObject(points=2500)
    painted.points[:, 2] *= 0.01
    mirrored = np.abs(painted.points)
    painted.descriptors = np.sin(mirrored @ np.random.default_rng(3).normal(size=(3, 48)) * 12).astype(np.float32)
    return painted.encode(views, moved).views


def test_a_plate_face_down_does_not_lie_on_one_face_up(moved: Sim3) -> None:
    over = Sim3(1.0, Rotation.from_euler("x", 180, degrees=True).as_matrix(), np.zeros(3))
    right, wrong = agreement_of(plate(Sim3.identity(), 6), plate(moved, 5)).score(Sim3Batch.of([moved, moved @ over]))
    assert right > 0.5
    assert wrong < 0.1 * right
