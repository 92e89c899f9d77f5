"""From view pairs to a transform, as the paper and the work it compares with do it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from core.affine9 import Affine9, fit_affine9
from core.boxes import cloud_extent_m
from core.clock import StageClock
from core.errors import NoPose
from core.estimators.base import MAX_SCALE, Estimator, errors_m, root_mean_square
from core.estimators.ransac import REFITS
from core.hypotheses import align_clouds
from core.matched_pair import MatchedPair, Pairs
from core.matches import Matches, end_points, pool
from core.pose_estimate import PoseEstimate
from core.sim3 import Sim3
from core.viewpoints import consensus, mean_rotation, near_their_mean


def by_retrieval(pair: MatchedPair, consensus_deg: float | None, threshold_m: float, clock: StageClock) -> PoseEstimate:
    """R and RC: the mean rotation of the best view pairs, with C those far from it removed one by one (paper, table 1).

    The paper reports rotations only; scale and translation here make the clouds' extents and medians agree.
    """
    pairs = pair.best_pairs()
    if not pairs:
        raise NoPose("no view of the target resembles any view of the reference; send more views")
    if not cloud_extent_m(pair.surfaces[1].points_m):
        raise NoPose("depth was measured at one point of the target, so its size is not determined; send more views or better depth")
    rotations = pair.rotations(pairs)
    if consensus_deg is not None:
        agree = near_their_mean(rotations, consensus_deg)
        pairs, rotations = [each for each, kept in zip(pairs, agree) if kept], rotations[agree]
    transform = align_clouds(mean_rotation(rotations)[None], *pair.surfaces)[0]
    matches, residual_m = mark_inliers(pool(pair.found, pairs), transform, pair, threshold_m)
    clock.lap("views")
    return PoseEstimate(transform, matches, pair.similarity, tuple(pairs), residual_m)


def by_consensus(
    pair: MatchedPair, consensus_deg: float | None, fit: Estimator, threshold_m: float, seed: int, clock: StageClock
) -> PoseEstimate:
    """U, with C where there is an angle: best view pairs, consensus, RANSAC ("Viewpoint estimation", "Final pose estimation")."""
    pairs = pair.best_pairs()
    if consensus_deg is not None and pairs:
        agree = consensus(pair.rotations(pairs), pair.similarities(pairs), consensus_deg, seed)
        pairs = [each for each, kept in zip(pairs, agree) if kept]
    clock.lap("views")
    return _fitted(pair, pairs, fit, threshold_m, seed, clock)


def by_single_view(pair: MatchedPair, fit: Estimator, threshold_m: float, seed: int, clock: StageClock) -> PoseEstimate:
    """Goodwin 2022, which the paper compares with ("Multi-view one-shot pose estimation"): the reference's first view that shows the
    object, the target view most similar to it, and nothing else."""
    rows = np.flatnonzero(pair.similarity.max(axis=1) > 0)
    pairs = [(int(rows[0]), int(pair.similarity[rows[0]].argmax()))] if len(rows) else []
    clock.lap("views")
    return _fitted(pair, pairs, fit, threshold_m, seed, clock)


def _fitted(pair: MatchedPair, pairs: Pairs, fit: Estimator, threshold_m: float, seed: int, clock: StageClock) -> PoseEstimate:
    matches = pool(pair.found, pairs)
    found = fit(*end_points(matches, pair.reference, pair.target), threshold_m, seed)
    clock.lap("solve")
    marked = replace(matches, inlier=found.inlier)
    return PoseEstimate(found.target_from_reference, marked, pair.similarity, tuple(pairs), found.residual_m)


def axis_scales(estimate: PoseEstimate, pair: MatchedPair, world_from_object: Sim3, threshold_m: float) -> Affine9:
    """target_from_object: the 9-D transform of the correspondences which agree with a 7-D one (appendix, "Replacing 7D similarity
    transform with 9D affine transform").

    Fitted to the inliers, which are then counted again, while that loses none. Raises NoPose where they do not determine it.
    """
    source, aim = end_points(estimate.matches, pair.reference, pair.target)
    source = world_from_object.inverse().apply(source)
    inlier = estimate.matches.inlier
    transform = _bounded(fit_affine9(source[inlier], aim[inlier]))
    for _ in range(REFITS - 1):
        again = errors_m(transform, source, aim) < threshold_m
        if again.sum() < inlier.sum():
            break
        inlier = again
        transform = _bounded(fit_affine9(source[inlier], aim[inlier]))
    return transform


def _bounded(transform: Affine9) -> Affine9:
    if transform.scales.max() > MAX_SCALE or transform.scales.min() < 1 / MAX_SCALE:
        raise NoPose(f"the scales {np.round(transform.scales, 2).tolist()} of the axes are beyond 1/{MAX_SCALE:g} to {MAX_SCALE:g}")
    return transform


def stretched(estimate: PoseEstimate, transform: Affine9, pair: MatchedPair, world_from_object: Sim3, threshold_m: float) -> PoseEstimate:
    """The estimate with a 9-D transform, a target_from_object, in place of its 7-D one."""
    source, aim = end_points(estimate.matches, pair.reference, pair.target)
    errors = errors_m(transform, world_from_object.inverse().apply(source), aim)
    inlier = errors < threshold_m
    return replace(
        estimate,
        target_from_object=transform,
        target_from_reference=transform.similarity() @ world_from_object.inverse(),
        matches=replace(estimate.matches, inlier=inlier),
        residual_m=root_mean_square(errors[inlier]),
    )


def mark_inliers(matches: Matches, transform: Sim3, pair: MatchedPair, threshold_m: float) -> tuple[Matches, float]:
    """Correspondences marked as inliers of a transform or not, and the inliers' residual."""
    source, aim = end_points(matches, pair.reference, pair.target)
    errors = errors_m(transform, source, aim)
    inlier = errors < threshold_m
    return replace(matches, inlier=inlier), root_mean_square(errors[inlier])
