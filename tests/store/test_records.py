"""What is kept of an estimated pose."""

from __future__ import annotations

import numpy as np
import pytest

from core.affine9 import Affine9
from core.matches import Matches
from core.pose_estimate import Alternative, PoseEstimate
from core.reference import Reference
from core.sim3 import Sim3
from core.views import Burst, View
from store.records import Pose

PLACED = Sim3(0.5, np.eye(3), np.array([1.0, 2, 3]))
SEEN_IN = [2, 1, 1]
"""Target view of each correspondence."""


@pytest.fixture
def estimate() -> PoseEstimate:
    """Three correspondences, of which the last two agree."""
    numbers = np.arange(3)
    matches = Matches(np.zeros(3, int), numbers, np.array(SEEN_IN), numbers, np.ones(3), np.array([False, True, True]))
    stretched = Affine9(np.array([0.5, 0.6, 0.7]), np.eye(3), np.array([4.0, 5, 6]))
    rival = Alternative(PLACED, 0.4, 0.2)
    return PoseEstimate(PLACED, matches, np.ones((1, 3)), ((0, 2), (0, 1)), 0.01, 0.7, 0.8, (rival,), stretched, "it is flat")


def test_an_estimate_is_kept(estimate: PoseEstimate, reference: Reference, burst: Burst) -> None:
    kept = Pose.of(estimate, reference, burst)
    assert (kept.target_from_reference, kept.target_from_object) == (PLACED, estimate.target_from_object)
    assert (kept.inliers, kept.correspondences, kept.residual_m, kept.score, kept.confidence) == (2, 3, 0.01, 0.7, 0.8)
    assert (kept.alternatives, kept.not_9d_because) == (estimate.alternatives, "it is flat")
    assert kept.symmetries is reference.symmetries


def test_the_best_view_is_where_most_agrees(estimate: PoseEstimate, reference: Reference, burst: Burst) -> None:
    assert Pose.of(estimate, reference, burst).best_view == 1


def test_the_box_is_the_references_on_the_target(estimate: PoseEstimate, reference: Reference, burst: Burst) -> None:
    assert np.allclose(Pose.of(estimate, reference, burst).box.corners(), estimate.box(reference.box).corners())


def test_where_the_box_is_in_each_view_is_kept(estimate: PoseEstimate, reference: Reference, burst: Burst) -> None:
    first, *_ = burst.views
    kept = Pose.of(estimate, reference, Burst([first, View(first.rgb)]))
    assert kept.boxes_px == (kept.box.within_image(first.camera, first.size), None)
