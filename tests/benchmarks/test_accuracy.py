"""Figures over pose errors with known answers."""

from __future__ import annotations

import numpy as np

from benchmarks.accuracy import NO_POSE, accuracy, median
from clients.pose_error import PoseError, pose_error
from core.sim3 import Sim3

EXACT = PoseError(0.0, 0.0, 0.0)


def test_an_exact_estimate_is_within_every_threshold() -> None:
    world_from_model = Sim3(0.5, np.eye(3), np.array([1.0, -2.0, 0.5]))
    error = pose_error(Sim3.identity(), world_from_model, world_from_model)
    assert error.rotation_deg == 0
    assert accuracy([error], 7.5) == 100


def test_a_threshold_is_within_itself() -> None:
    assert accuracy([PoseError(angle_deg, 0, 0) for angle_deg in (14.9, 15.0, 15.1, 90.0)], 15) == 50


def test_a_refused_pose_counts_as_the_worst() -> None:
    assert accuracy([EXACT, EXACT, EXACT, NO_POSE], 30) == 75
    assert median([EXACT, NO_POSE, NO_POSE], "rotation_deg") == 180
    assert median([EXACT, EXACT, NO_POSE], "translation") == 0
    assert median([EXACT, NO_POSE], "translation") == np.inf
