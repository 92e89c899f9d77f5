"""Scores of poses with known answers, and figures over many."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from clients.pose_error import NO_POSE, PoseError, accuracy, median, pose_error
from core.sim3 import Sim3

REFERENCE = Sim3(0.4, Rotation.from_euler("xyz", [10, 70, -30], degrees=True).as_matrix(), np.array([0.3, -1.0, 2.0]))
TARGET = Sim3(0.6, Rotation.from_euler("xyz", [-50, 20, 140], degrees=True).as_matrix(), np.array([5.0, 0.2, -0.7]))
TRUTH = TARGET @ REFERENCE.inverse()


def turned(angle_deg: float) -> Sim3:
    """An estimate whose object is turned by `angle_deg` about its own upright axis."""
    about_model = Sim3(1.0, Rotation.from_euler("z", angle_deg, degrees=True).as_matrix(), np.zeros(3))
    return TARGET @ about_model @ REFERENCE.inverse()


def test_the_truth_has_no_error() -> None:
    error = pose_error(TRUTH, REFERENCE, TARGET)
    assert error.rotation_deg == pytest.approx(0, abs=1e-4)
    assert error.translation == pytest.approx(0, abs=1e-9)
    assert error.log_scale == pytest.approx(0, abs=1e-9)


def test_a_turn_is_its_angle() -> None:
    assert pose_error(turned(40), REFERENCE, TARGET).rotation_deg == pytest.approx(40)


def test_a_turn_that_is_a_symmetry_is_none() -> None:
    half = Rotation.from_euler("z", 180, degrees=True).as_matrix()
    assert pose_error(turned(180), REFERENCE, TARGET).rotation_deg == pytest.approx(180)
    assert pose_error(turned(180), REFERENCE, TARGET, [half]).rotation_deg == pytest.approx(0, abs=1e-4)
    assert pose_error(turned(170), REFERENCE, TARGET, [half]).rotation_deg == pytest.approx(10)


def test_translation_is_a_fraction_of_the_diagonal_and_scale_a_logarithm() -> None:
    shifted = Sim3(TRUTH.scale, TRUTH.rotation, TRUTH.translation + [0.0, 0.3, 0.0])
    assert pose_error(shifted, REFERENCE, TARGET).translation == pytest.approx(0.3 / 0.6)
    doubled = Sim3(2 * TARGET.scale, TARGET.rotation, TARGET.translation) @ REFERENCE.inverse()
    assert pose_error(doubled, REFERENCE, TARGET).log_scale == pytest.approx(np.log(2))


EXACT = PoseError(0.0, 0.0, 0.0)


def test_a_threshold_is_within_itself() -> None:
    assert accuracy([PoseError(angle_deg, 0, 0) for angle_deg in (14.9, 15.0, 15.1, 90.0)], 15) == 50


def test_a_refused_pose_counts_as_the_worst() -> None:
    assert accuracy([EXACT, EXACT, EXACT, NO_POSE], 30) == 75
    assert median([EXACT, NO_POSE, NO_POSE], "rotation_deg") == 180
    assert median([EXACT, EXACT, NO_POSE], "translation") == 0
    assert median([EXACT, NO_POSE], "translation") == np.inf
