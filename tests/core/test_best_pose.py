"""The variant `best` tells of rivals."""

from __future__ import annotations

import numpy as np

from core.pose import VARIANTS, PoseEstimator
from core.sim3 import Sim3, rotation_angle_deg

from .conftest import PaintedObject, turned


def test_an_object_that_looks_the_same_from_behind_has_a_rival(painted: PaintedObject, moved: Sim3) -> None:
    painted.points = np.concatenate([painted.points, turned(180).apply(painted.points)])
    painted.descriptors = np.concatenate([painted.descriptors, painted.descriptors])
    estimate = PoseEstimator(VARIANTS["best"]).estimate(painted.reference(6), painted.encode(4, moved))
    rival = estimate.alternatives[0]
    assert estimate.score is not None
    assert estimate.score * 0.8 < rival.score <= estimate.score
    assert rotation_angle_deg(rival.target_from_reference.rotation, estimate.target_from_reference.rotation) > 170
