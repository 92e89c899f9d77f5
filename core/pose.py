"""The pose pipeline: descriptors of a reference and a burst in, a 7-D transform out; every variant is a config.

Letters: M reference views, N target views, K correspondences, T transforms.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
import torch

from core.boxes import cloud_extent_m
from core.clock import StageClock
from core.correspond import METHODS
from core.dense import DenseAgreement, DenseConfig
from core.encode import EncodedBurst
from core.errors import InvalidInput, NoPose
from core.estimators.base import refit
from core.estimators.ransac import ransac
from core.hypotheses import HypothesesConfig, align_clouds, distinct, propose
from core.matched_pair import MatchedPair
from core.matches import Alternative, Matches, PoseEstimate, among_all_patches, end_points, pool
from core.reference import Reference
from core.sim3 import Sim3
from core.viewpoints import (
    consensus,
    mean_rotation,
    near_their_mean,
    view_agreement,
)


@dataclass(frozen=True)
class BestConfig:
    """What the variant `best` adds: many hypotheses, judged and refined over all points."""

    hypotheses: HypothesesConfig = field(default_factory=HypothesesConfig)
    dense: DenseConfig = field(default_factory=DenseConfig)
    polish: DenseConfig = field(default_factory=lambda: DenseConfig(points=1200))
    """For the last refinement, of the winner alone."""
    view_weight: float = 0.25
    """Weight of the agreement of view pairs beside the log of the dense score."""
    view_deg: float = 40.0
    """Angle over which a view pair speaks for a rotation."""
    refined: int = 12
    """Hypotheses that are refined: the best of those that differ in rotation."""
    distinct_deg: float = 12.0
    alternative_deg: float = 30.0
    """An alternative differs by at least this from better ones."""
    alternatives: int = 3


@dataclass(frozen=True)
class PoseConfig:
    """Settings of the pipeline; the defaults are the paper's UCD."""

    variant: str = "ucd"
    dims: int | None = 32
    """Principal components of a descriptor; None keeps all dimensions (paper, table 2)."""
    correspondences: int = 50
    """K of a view pair."""
    method: str = "cyclical"
    """One of `core.correspond.METHODS`."""
    consensus_deg: float | None = 30.0
    """θ of the consensus; None leaves it out (variants without C)."""
    inlier_ratio: float = 0.08
    """Inlier threshold as a share of the target's extent."""
    solver: Literal["retrieval", "umeyama", "agreement"] = "umeyama"
    """From view pairs to a transform: the mean of their rotations, the paper's RANSAC, or ours over many hypotheses."""
    best: BestConfig = field(default_factory=BestConfig)
    """Of the solver `agreement`."""

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise InvalidInput("method", f"{self.method!r} is none of {', '.join(METHODS)}")

    @staticmethod
    def named(variant: str) -> PoseConfig:
        """The config of a variant. Raises InvalidInput for an unknown name."""
        if variant not in VARIANTS:
            raise InvalidInput("variant", f"{variant!r} is none of {', '.join(VARIANTS)}")
        return VARIANTS[variant]


_UCD = PoseConfig()
VARIANTS = {
    "best": replace(_UCD, variant="best", solver="agreement"),
    "ucd": _UCD,
    "ucd+": replace(_UCD, variant="ucd+"),
    "ud": replace(_UCD, variant="ud", consensus_deg=None),
    "uc": replace(_UCD, variant="uc", dims=None),
    "u": replace(_UCD, variant="u", dims=None, consensus_deg=None),
    "rc": replace(_UCD, variant="rc", dims=None, solver="retrieval"),
    "r": replace(_UCD, variant="r", dims=None, consensus_deg=None, solver="retrieval"),
}
"""`best` is ours; of the paper's letters (table 1), R is retrieval, U Umeyama, C consensus, D reduced
descriptors, + all the views there are."""


class PoseEstimator:
    """Estimates `target_from_reference` with one config."""

    def __init__(self, config: PoseConfig | None = None) -> None:
        self.config = config or PoseConfig()

    def estimate(self, reference: Reference, target: EncodedBurst, *, seed: int = 0) -> PoseEstimate:
        """The similarity from the reference scan's world to the burst's world.

        Raises InvalidInput for tokens of another backbone or views without cameras or depth, NoPose where nothing fits.
        """
        require_comparable(reference, target)
        clock, config = StageClock(), self.config
        pair = MatchedPair(reference, target, config.dims, config.correspondences, config.method)
        clock.lap("match")
        threshold_m = self.config.inlier_ratio * cloud_extent_m(target.cloud_m)
        solve = {"retrieval": self._by_retrieval, "umeyama": self._by_consensus, "agreement": self._by_agreement}[self.config.solver]
        estimate = solve(pair, threshold_m, seed, clock)
        return replace(estimate, matches=among_all_patches(estimate.matches, reference.views, target.views), stage_ms=clock.stage_ms)

    def _by_retrieval(self, pair: MatchedPair, threshold_m: float, seed: int, clock: StageClock) -> PoseEstimate:
        """The paper's R and RC: the mean rotation of the best view pairs, those far from it removed one by one with C (table 1).

        The paper reports rotations only; scale and translation here make the clouds' extents and medians agree.
        """
        pairs = pair.best_pairs()
        if not pairs:
            raise NoPose("no view of the target resembles any view of the reference; send more views")
        rotations = pair.rotations(pairs)
        if self.config.consensus_deg is not None:
            agree = near_their_mean(rotations, self.config.consensus_deg)
            pairs, rotations = [each for each, kept in zip(pairs, agree) if kept], rotations[agree]
        transform = align_clouds(mean_rotation(rotations)[None], *pair.clouds)[0]
        matches, residual_m = _judge(pool(pair.found, pairs), transform, pair, threshold_m)
        clock.lap("views")
        return PoseEstimate(transform, matches, pair.similarity, tuple(pairs), residual_m)

    def _by_consensus(self, pair: MatchedPair, threshold_m: float, seed: int, clock: StageClock) -> PoseEstimate:
        """The paper's pipeline: best view pairs, consensus, RANSAC ("Viewpoint estimation", "Final pose estimation")."""
        pairs = pair.best_pairs()
        if self.config.consensus_deg is not None and pairs:
            agree = consensus(pair.rotations(pairs), pair.similarities(pairs), self.config.consensus_deg, seed)
            pairs = [each for each, kept in zip(pairs, agree) if kept]
        clock.lap("views")
        matches = pool(pair.found, pairs)
        fit = ransac(*end_points(matches, pair.reference, pair.target), threshold_m, seed)
        clock.lap("solve")
        return PoseEstimate(
            fit.target_from_reference, replace(matches, inlier=fit.inlier), pair.similarity, tuple(pairs), residual_m=fit.residual_m
        )

    def _by_agreement(self, pair: MatchedPair, threshold_m: float, seed: int, clock: StageClock) -> PoseEstimate:
        """Ours: many hypotheses, the most promising refined, the one that lays the objects on each other best."""
        config = self.config.best
        guesses = propose(pair, config.hypotheses, threshold_m, seed)
        if not len(guesses):
            raise NoPose("no view pair gives a hypothesis of plausible size; send more views or better depth")
        clock.lap("propose")
        agreement = DenseAgreement(pair.reference, pair.target, pair.descriptors, config.dense, seed)
        promising = distinct(guesses, agreement.score(guesses), config.distinct_deg, config.refined)
        clock.lap("score")
        refined = agreement.refine(guesses.select(promising))
        scores = agreement.score(refined)
        views = view_agreement(refined.rotation.numpy(), pair.relative, pair.similarity, config.view_deg)
        scores = scores * torch.from_numpy(np.exp(config.view_weight * views))
        ranked = distinct(refined, scores, config.alternative_deg, 1 + config.alternatives)
        clock.lap("refine")
        polish = DenseAgreement(pair.reference, pair.target, pair.descriptors, config.polish, seed)
        transform = polish.refine(refined.select(ranked[:1]))[0]
        clock.lap("polish")
        pairs = pair.best_pairs()
        matches, residual_m = _judge(pool(pair.found, pairs), transform, pair, threshold_m)
        alternatives = tuple(Alternative(refined[index], float(scores[index])) for index in ranked[1:])
        score = float(scores[ranked[0]])
        return PoseEstimate(transform, matches, pair.similarity, tuple(pairs), residual_m, score=score, alternatives=alternatives)


def _judge(matches: Matches, transform: Sim3, pair: MatchedPair, threshold_m: float) -> tuple[Matches, float]:
    """Correspondences marked as inliers of a transform, and the inliers' residual."""
    source, aim = end_points(matches, pair.reference, pair.target)
    inlier = np.linalg.norm(transform.apply(source) - aim, axis=1) < threshold_m
    return replace(matches, inlier=inlier), refit(source, aim, transform, inlier).residual_m


def require_comparable(reference: Reference, target: EncodedBurst) -> None:
    """Raises InvalidInput where descriptors, cameras or depth do not allow a 7-D pose."""
    if reference.fingerprint != target.fingerprint:
        raise InvalidInput(
            "reference",
            f"was made with backbone {reference.fingerprint}, the burst with {target.fingerprint}; their tokens cannot be compared",
        )
    for index, view in enumerate(target.views):
        if view.camera is None:
            raise InvalidInput(f"views[{index}].K", "is missing: a pose needs K and world_from_camera for every view")
    if not len(target.cloud_m):
        raise InvalidInput("views", "no depth was measured on the object: a 7-D pose needs depth in at least one view")
