"""The pipeline, from encoded views to a transform."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core.correspond import METHODS
from core.encode import EncodedBurst
from core.errors import InvalidInput, NoPose
from core.estimators import ESTIMATORS
from core.pose import VARIANTS, PoseConfig, PoseEstimator, PoseOptions
from core.sim3 import Sim3, rotation_angle_deg

from .conftest import PaintedObject, blind


def assert_recovered(found: Sim3, applied: Sim3) -> None:
    assert rotation_angle_deg(found.rotation, applied.rotation) < 2
    assert abs(np.log(found.scale / applied.scale)) < 0.03
    assert np.linalg.norm(found.translation - applied.translation) < 0.02


@pytest.mark.parametrize("variant", sorted(set(VARIANTS) - {"r", "rc"}))
def test_a_similarity_applied_by_hand_is_recovered(variant: str, painted: PaintedObject, moved: Sim3) -> None:
    reference = painted.reference(6)
    estimate = PoseEstimator(PoseConfig.named(variant)).estimate(reference, painted.encode(5, moved))
    assert_recovered(estimate.target_from_reference, moved)


@pytest.mark.parametrize("variant", ["r", "rc"])
def test_retrieval_is_right_to_the_spacing_of_views(variant: str, painted: PaintedObject, moved: Sim3) -> None:
    reference = painted.reference(12)
    found = PoseEstimator(PoseConfig.named(variant)).estimate(reference, painted.encode(8, moved)).target_from_reference
    assert rotation_angle_deg(found.rotation, moved.rotation) < 20
    assert abs(np.log(found.scale / moved.scale)) < 0.1


@pytest.mark.parametrize("method", METHODS)
def test_by_every_way_to_match_it_is_recovered(method: str, painted: PaintedObject, moved: Sim3) -> None:
    reference = painted.reference(6)
    estimate = PoseEstimator(PoseConfig(method=method)).estimate(reference, painted.encode(5, moved))
    assert_recovered(estimate.target_from_reference, moved)


@pytest.mark.parametrize("estimator", sorted(ESTIMATORS))
@pytest.mark.parametrize("dims", [48, 32, 24, 6, 3])
def test_with_every_descriptor_size_and_estimator_it_is_recovered(dims: int, estimator: str, painted: PaintedObject, moved: Sim3) -> None:
    config = PoseConfig.named("ucd", PoseOptions(dims=dims, estimator=estimator, consensus_deg=15, inlier_ratio=0.05))
    assert (config.dims, config.estimator, config.consensus_deg, config.inlier_ratio) == (dims, estimator, 15, 0.05)
    estimate = PoseEstimator(config).estimate(painted.reference(6), painted.encode(5, moved))
    assert_recovered(estimate.target_from_reference, moved)


def test_whole_tokens_by_their_size_or_by_none_are_the_same(painted: PaintedObject, moved: Sim3) -> None:
    reference, target = painted.reference(4), painted.encode(3, moved)
    by_size, by_none = (PoseEstimator(PoseConfig(dims=dims)).estimate(reference, target) for dims in (48, None))
    assert np.array_equal(by_size.target_from_reference.as_matrix(), by_none.target_from_reference.as_matrix())


@pytest.mark.parametrize(
    ("variant", "options"),
    [
        ("u", PoseOptions(consensus_deg=15)),
        ("best", PoseOptions(consensus_deg=15)),
        ("best", PoseOptions(estimator="pycolmap")),
        ("r", PoseOptions(estimator="ransac")),
        ("ucd", PoseOptions(inlier_ratio=-1)),
        ("ucd", PoseOptions(method="psychic")),
        ("ucd", PoseOptions(estimator="luck")),
        ("ucd", PoseOptions(dims=0)),
        ("ucd", PoseOptions(dof=6)),
    ],
)
def test_an_option_without_effect_or_sense_is_refused_by_its_name(variant: str, options: PoseOptions) -> None:
    (name,) = (name for name, value in vars(options).items() if value is not None)
    with pytest.raises(InvalidInput) as caught:
        PoseConfig.named(variant, options)
    assert caught.value.field == name


def test_more_components_than_are_kept_are_refused(painted: PaintedObject) -> None:
    with pytest.raises(InvalidInput, match="48 for whole tokens, found 65"):
        PoseEstimator(PoseConfig(dims=65)).estimate(painted.reference(3), painted.encode(2))


@pytest.mark.parametrize(("variant", "tolerance"), [("ucd", 0.04), ("best", 0.08)])
def test_nine_degrees_recover_a_scale_for_each_axis(variant: str, tolerance: float, painted: PaintedObject, moved: Sim3) -> None:
    reference = painted.reference(8)
    stretched = PaintedObject()
    axes = reference.box.world_from_object[:3, :3]
    scales = np.array([1.25, 0.85, 1.0])
    stretched.points = stretched.points @ (axes * scales @ axes.T)
    estimate = PoseEstimator(PoseConfig.named(variant, PoseOptions(dof=9))).estimate(reference, stretched.encode(8, moved))
    assert estimate.target_from_object is not None
    assert np.allclose(estimate.target_from_object.scales / moved.scale, scales, atol=tolerance)
    assert rotation_angle_deg(estimate.target_from_reference.rotation, moved.rotation) < 2
    assert np.allclose(estimate.box(reference.box).extent_m, reference.box.extent_m * scales * moved.scale, rtol=tolerance)
    linear = estimate.matrix(reference.box)[:3, :3]
    assert np.allclose(linear, moved.scale * moved.rotation @ (axes * scales @ axes.T), atol=2 * tolerance)


def test_points_that_do_not_determine_nine_degrees_keep_seven_and_say_why(moved: Sim3) -> None:
    flat = PaintedObject()
    flat.points[:, 2] = 0
    estimator = PoseEstimator(PoseConfig.named("ucd", PoseOptions(dof=9)))
    estimate = estimator.estimate(flat.reference(8), flat.encode(6, moved))
    assert_recovered(estimate.target_from_reference, moved)
    assert estimate.target_from_object is None
    assert "plane" in str(estimate.not_9d_because)
    box = flat.reference(8).box
    assert np.allclose(estimate.matrix(box), estimate.target_from_reference.as_matrix())


def test_zsp_uses_one_view_of_each(painted: PaintedObject, moved: Sim3) -> None:
    reference, target = painted.reference(5), painted.encode(4, moved)
    estimate = PoseEstimator(PoseConfig.named("zsp")).estimate(reference, target)
    assert estimate.pairs == ((0, int(estimate.view_similarity[0].argmax())),)
    assert set(estimate.matches.reference_view) == {0}


def test_the_seed_decides_everything(painted: PaintedObject, moved: Sim3) -> None:
    reference, target = painted.reference(4), painted.encode(3, moved)
    first, second = (PoseEstimator().estimate(reference, target, seed=3) for _ in range(2))
    assert np.array_equal(first.target_from_reference.as_matrix(), second.target_from_reference.as_matrix())


def test_matches_point_at_patches_that_have_depth(painted: PaintedObject, moved: Sim3) -> None:
    target = painted.encode(3, moved)
    half_blind = replace(
        target.views[0], points_m=np.where(np.arange(len(target.views[0].cells))[:, None] % 2, np.nan, target.views[0].points_m)
    )
    target = EncodedBurst((half_blind, *target.views[1:]), target.fingerprint)
    matches = PoseEstimator().estimate(painted.reference(6), target).matches
    assert len(matches) > 20
    assert all(target.views[view].trusted[patch] for view, patch in zip(matches.target_view, matches.target_patch))


def test_a_single_target_view_is_enough(painted: PaintedObject, moved: Sim3) -> None:
    reference = painted.reference(8)
    assert_recovered(PoseEstimator().estimate(reference, painted.encode(1, moved)).target_from_reference, moved)


def test_a_target_without_depth_is_refused(painted: PaintedObject) -> None:
    with pytest.raises(InvalidInput, match="depth"):
        PoseEstimator().estimate(painted.reference(4), blind(painted.encode(2)))


def test_tokens_of_another_backbone_are_refused(painted: PaintedObject) -> None:
    target = replace(painted.encode(2), fingerprint="other")
    with pytest.raises(InvalidInput, match="backbone"):
        PoseEstimator().estimate(painted.reference(4), target)


@pytest.mark.parametrize("variant", sorted(VARIANTS))
def test_without_a_match_there_is_no_pose(variant: str, painted: PaintedObject) -> None:
    target = painted.encode(2)
    blank = replace(target, views=tuple(replace(view, descriptors=np.zeros_like(view.descriptors)) for view in target.views))
    reference = painted.reference(4)
    zero_mean = replace(reference.basis, mean=np.zeros_like(reference.basis.mean))
    with pytest.raises(NoPose):
        PoseEstimator(PoseConfig.named(variant)).estimate(replace(reference, basis=zero_mean), blank)


@pytest.mark.parametrize("variant", sorted(VARIANTS))
def test_one_point_with_depth_is_no_pose(variant: str, painted: PaintedObject) -> None:
    (view,) = painted.encode(1).views
    points = np.full_like(view.points_m, np.nan)
    points[0] = view.points_m[0]
    with pytest.raises(NoPose):
        PoseEstimator(PoseConfig.named(variant)).estimate(painted.reference(4), EncodedBurst((replace(view, points_m=points),), "painted"))


def test_an_unknown_variant_is_named() -> None:
    with pytest.raises(InvalidInput, match="ucd"):
        PoseConfig.named("nonsense")
