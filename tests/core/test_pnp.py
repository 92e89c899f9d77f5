"""A pose of a target without depth: from the reference's points and rays of several views."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core.encode import EncodedBurst
from core.errors import InvalidInput, NoPose
from core.pose import PoseConfig, PoseEstimator, PoseOptions
from core.sim3 import Sim3, rotation_angle_deg

from .conftest import PaintedObject, blind, first_patches, turned


@pytest.fixture
def estimator() -> PoseEstimator:
    return PoseEstimator(PoseConfig.named("pnp"))


def test_rotation_place_and_size_follow_from_views_without_depth(painted: PaintedObject, moved: Sim3, estimator: PoseEstimator) -> None:
    reference, target = painted.reference(8), blind(painted.encode(5, moved))
    estimate = estimator.estimate(reference, target)
    found = estimate.target_from_reference
    assert rotation_angle_deg(found.rotation, moved.rotation) < 2
    assert abs(np.log(found.scale / moved.scale)) < 0.03
    assert np.linalg.norm(found.apply(np.zeros(3)) - moved.apply(np.zeros(3))) < 0.03
    assert estimate.residual_m < 0.03
    assert estimate.inliers > 0.5 * len(estimate.matches)
    assert all(patch < len(target.views[view].cells) for view, patch in zip(estimate.matches.target_view, estimate.matches.target_patch))


def test_it_survives_correspondences_of_which_a_third_are_wrong(painted: PaintedObject, moved: Sim3, estimator: PoseEstimator) -> None:
    rng = np.random.default_rng(0)
    target = blind(painted.encode(6, moved))
    views = []
    for view in target.views:
        descriptors = view.descriptors.copy()
        wrong = rng.random(len(descriptors)) < 1 / 3
        descriptors[wrong] = rng.permutation(descriptors[wrong])
        views.append(replace(view, descriptors=descriptors))
    reference = painted.reference(8)
    found = estimator.estimate(reference, EncodedBurst(tuple(views), target.fingerprint)).target_from_reference
    assert rotation_angle_deg(found.rotation, moved.rotation) < 4
    assert abs(np.log(found.scale / moved.scale)) < 0.06


def test_the_seed_decides_everything(painted: PaintedObject, moved: Sim3, estimator: PoseEstimator) -> None:
    reference, target = painted.reference(6), blind(painted.encode(3, moved))
    first, again = (estimator.estimate(reference, target, seed=4).target_from_reference.as_matrix() for _ in range(2))
    assert np.array_equal(first, again)


def test_one_view_does_not_tell_size(painted: PaintedObject, moved: Sim3, estimator: PoseEstimator) -> None:
    with pytest.raises(NoPose, match="different sides"):
        estimator.estimate(painted.reference(6), blind(painted.encode(1, moved)))


def test_two_views_from_one_place_do_not_tell_size(painted: PaintedObject, moved: Sim3, estimator: PoseEstimator) -> None:
    view = blind(painted.encode(1, moved)).views[0]
    with pytest.raises(NoPose, match="different sides"):
        estimator.estimate(painted.reference(6), EncodedBurst((view, view), "painted"))


def test_views_from_nearly_one_place_do_not_tell_size(painted: PaintedObject, estimator: PoseEstimator) -> None:
    """A pose is found that both agree with, and would be of any size but for noise."""
    here, beside = (blind(painted.encode(1, turned(angle_deg))).views[0] for angle_deg in (0, 3))
    with pytest.raises(NoPose, match="those that agree are [23]° apart, at least 5° are needed"):
        estimator.estimate(painted.reference(8), EncodedBurst((here, beside), "painted"))


def test_too_few_patches_are_no_pose(painted: PaintedObject, estimator: PoseEstimator) -> None:
    few = first_patches(blind(painted.encode(3)), 2)
    with pytest.raises(NoPose, match="only 4 patches of the target agree"):
        estimator.estimate(painted.reference(4), few)


def test_cameras_are_needed(painted: PaintedObject, estimator: PoseEstimator) -> None:
    target = blind(painted.encode(2))
    views = (target.views[0], replace(target.views[1], camera=None))
    with pytest.raises(InvalidInput, match=r"views\[1\].K"):
        estimator.estimate(painted.reference(4), EncodedBurst(views, target.fingerprint))


def test_nine_degrees_of_freedom_are_refused() -> None:
    with pytest.raises(InvalidInput, match="dof"):
        PoseConfig.named("pnp", PoseOptions(dof=9))
