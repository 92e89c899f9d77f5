"""The variant `best`, which is ours: many hypotheses, the most promising refined, judged by how well they lay the objects on each other.

Letters: S symmetries.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import torch

from core.affine9 import Affine9
from core.clock import StageClock
from core.confidence import probabilities
from core.dense import DenseAgreement, DenseConfig
from core.errors import NoPose
from core.hypotheses import HypothesesConfig, distinct, propose
from core.matched_pair import MatchedPair
from core.matches import pool
from core.pose_estimate import Alternative, PoseEstimate
from core.sim3 import Sim3
from core.solvers import mark_inliers
from core.viewpoints import view_agreement
from core.views import FloatArray


@dataclass(frozen=True)
class BestConfig:
    """What the variant `best` adds: many hypotheses, judged and refined over all points."""

    hypotheses: HypothesesConfig = field(default_factory=HypothesesConfig)
    dense: DenseConfig = field(default_factory=DenseConfig)
    polish: DenseConfig | None = field(default_factory=lambda: DenseConfig(points=1200))
    """For the last refinement, of the winner alone; None leaves it out."""
    steady: bool = True
    """Refines by what is steady from view to view (`core.discriminant`), else by principal components."""
    view_weight: float = 0.05
    """Weight, for each target view, of the agreement of view pairs beside the log of the dense score: every view is further evidence."""
    most_view_weight: float = 0.5
    view_deg: float = 40.0
    """Angle over which a view pair speaks for a rotation."""
    refined: int = 24
    """Hypotheses that are refined: the best of those that differ in rotation."""
    distinct_deg: float = 10.0
    alternative_deg: float = 30.0
    """An alternative differs by at least this from better ones, and from what they are after a symmetry of the reference."""
    alternatives: int = 3


def by_agreement(
    pair: MatchedPair, config: BestConfig, symmetries: FloatArray, threshold_m: float, seed: int, clock: StageClock
) -> PoseEstimate:
    """Ours: many hypotheses, the most promising refined, the one that lays the objects on each other best.

    Of poses that are the same after one of `symmetries` of the reference, shape (S, 3, 3), the best alone is listed: they are no rivals.
    `threshold_m` is the inlier distance.
    """
    guesses = propose(pair, config.hypotheses, threshold_m, seed)
    if not len(guesses):
        raise NoPose("no view pair gives a hypothesis of plausible size; send more views or better depth")
    clock.lap("propose")
    agreement = DenseAgreement(*pair.surfaces, pair.descriptors, config.dense, seed)
    promising = distinct(guesses, agreement.score(guesses), config.distinct_deg, config.refined)
    clock.lap("score")
    descriptors = _refining(pair, config)
    refined = DenseAgreement(*pair.surfaces, descriptors, config.dense, seed).refine(guesses.select(promising))
    views = view_agreement(refined.rotation.numpy(), pair.relative, pair.similarity, config.view_deg)
    weight = min(config.view_weight * len(pair.target), config.most_view_weight)
    scores = agreement.score(refined) * torch.from_numpy(np.exp(weight * views))
    ranked = distinct(refined, scores, config.alternative_deg, 1 + config.alternatives, symmetries)
    clock.lap("refine")
    winner = refined.select(ranked[:1])
    if config.polish is not None:
        winner = DenseAgreement(*pair.surfaces, descriptors, config.polish, seed).refine(winner)
    transform = winner[0]
    clock.lap("polish")
    pairs = pair.best_pairs()
    matches, residual_m = mark_inliers(pool(pair.found, pairs), transform, pair, threshold_m)
    likely = probabilities(scores[ranked].double().numpy(), len(pair.target), pair.fingerprint)
    best, *rivals = [
        Alternative(refined[index], float(scores[index]), confidence) for index, confidence in zip(ranked, likely, strict=True)
    ]
    return PoseEstimate(
        transform,
        matches,
        pair.similarity,
        tuple(pairs),
        residual_m,
        score=best.score,
        confidence=best.confidence,
        alternatives=tuple(rivals),
    )


def axis_scales_by_agreement(estimate: PoseEstimate, pair: MatchedPair, config: BestConfig, world_from_object: Sim3, seed: int) -> Affine9:
    """target_from_object: the 9-D transform of what a 7-D one lays on each other. Raises NoPose where that does not determine it."""
    agreement = DenseAgreement(*pair.surfaces, _refining(pair, config), config.polish or config.dense, seed)
    return agreement.stretch(estimate.target_from_reference, world_from_object)


def _refining(pair: MatchedPair, config: BestConfig) -> tuple[list[FloatArray], list[FloatArray]]:
    """The descriptors that a hypothesis is refined by, of the reference and of the target."""
    return pair.steady_descriptors if config.steady else pair.descriptors
