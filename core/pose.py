"""The pose pipeline: descriptors of a reference and a burst in, a 7-D transform out; every variant is a config.

Letters: K correspondences of a view pair.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import Literal

import numpy as np

from core.best_pose import BestConfig, axis_scales_by_agreement, by_agreement
from core.boxes import cloud_extent_m
from core.clock import StageClock
from core.correspond import METHODS
from core.descriptors import component_count
from core.encode import EncodedBurst
from core.errors import InvalidInput, NoPose
from core.estimators import ESTIMATORS
from core.matched_pair import MatchedPair, require_comparable
from core.pnp import by_pnp
from core.pose_estimate import PoseEstimate
from core.reference import Reference
from core.sim3 import Sim3
from core.solvers import axis_scales, by_consensus, by_retrieval, by_single_view, stretched
from core.views import FloatArray


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
    estimator: str = "ransac"
    """One of `core.estimators.ESTIMATORS`; of the solvers that fit correspondences."""
    solver: Literal["retrieval", "single view", "umeyama", "agreement", "pnp"] = "umeyama"
    """From view pairs to a transform: the mean of their rotations, one pair alone, the paper's RANSAC, ours over many hypotheses, or
    the reference's points and the rays of target views without depth."""
    dof: int = 7
    """9 for a scale of each axis of the object's frame, fitted to what agrees with the 7-D transform."""
    all_views: bool = False
    """Every view there is takes part, of reference and target: whoever chooses views asks this first."""
    best: BestConfig = field(default_factory=BestConfig)
    """Of the solver `agreement`."""

    def __post_init__(self) -> None:
        for name, value, known in (("method", self.method, METHODS), ("estimator", self.estimator, tuple(ESTIMATORS))):
            if value not in known:
                raise InvalidInput(name, f"{value!r} is none of {', '.join(known)}")
        if self.dof not in (7, 9):
            raise InvalidInput("dof", f"expected 7 or 9, found {self.dof}")
        if self.dof == 9 and self.solver == "pnp":
            raise InvalidInput("dof", f"variant {self.variant} has no target points to fit nine degrees of freedom to; leave it at 7")
        for name, number in (("dims", self.dims), ("consensus_deg", self.consensus_deg), ("inlier_ratio", self.inlier_ratio)):
            if number is not None and not (np.isfinite(number) and number > 0):
                raise InvalidInput(name, f"expected a positive number, found {number}")

    @staticmethod
    def named(variant: str, options: PoseOptions | None = None) -> PoseConfig:
        """The config of a variant, with options of the caller's own.

        Raises InvalidInput for an unknown name and for an option that the variant makes no use of.
        """
        if variant not in VARIANTS:
            raise InvalidInput("variant", f"{variant!r} is none of {', '.join(VARIANTS)}")
        config = VARIANTS[variant]
        chosen = {name: value for name, value in asdict(options or PoseOptions()).items() if value is not None}
        if "consensus_deg" in chosen and config.consensus_deg is None:
            raise InvalidInput("consensus_deg", f"variant {variant} has no consensus of view pairs; leave it out, or take one with a c")
        if "estimator" in chosen and config.solver not in FITTING_SOLVERS:
            fitting = ", ".join(name for name, each in VARIANTS.items() if each.solver in FITTING_SOLVERS)
            raise InvalidInput("estimator", f"variant {variant} does not fit its correspondences; leave it out, or take one of {fitting}")
        return replace(config, **chosen)


@dataclass(frozen=True)
class PoseOptions:
    """What may be set beside a variant's name; None leaves it as the variant has it. Fields as in `PoseConfig`."""

    dims: int | None = None
    """The token size itself keeps whole tokens."""
    method: str | None = None
    consensus_deg: float | None = None
    inlier_ratio: float | None = None
    estimator: str | None = None
    dof: int | None = None


FITTING_SOLVERS = ("single view", "umeyama")
"""Those that fit a transform to correspondences, by an estimator."""
_UCD = PoseConfig()
VARIANTS = {
    "best": replace(_UCD, variant="best", consensus_deg=None, solver="agreement"),
    "ucd": _UCD,
    "ucd+": replace(_UCD, variant="ucd+", all_views=True),
    "ud": replace(_UCD, variant="ud", consensus_deg=None),
    "uc": replace(_UCD, variant="uc", dims=None),
    "u": replace(_UCD, variant="u", dims=None, consensus_deg=None),
    "rc": replace(_UCD, variant="rc", dims=None, solver="retrieval"),
    "r": replace(_UCD, variant="r", dims=None, consensus_deg=None, solver="retrieval"),
    "pnp": replace(_UCD, variant="pnp", consensus_deg=None, solver="pnp"),
    "zsp": replace(_UCD, variant="zsp", dims=None, consensus_deg=None, solver="single view"),
}
"""`best` is ours; of the paper's letters (table 1), R is retrieval, U Umeyama, C consensus, D reduced descriptors, + all the views
there are. `pnp` is for targets without depth (its "Limitations"). `zsp` is what it compares with, Goodwin 2022: one reference view and
the target view most similar to it."""


class PoseEstimator:
    """Estimates `target_from_reference` with one config."""

    def __init__(self, config: PoseConfig | None = None) -> None:
        self.config = config or PoseConfig()

    def estimate(self, reference: Reference, target: EncodedBurst, *, seed: int = 0) -> PoseEstimate:
        """The similarity from the reference scan's world to the burst's world.

        Raises InvalidInput for tokens of another backbone or views without cameras or depth, NoPose where nothing fits.
        """
        clock, config = StageClock(), self.config
        require_comparable(reference, target)
        if not (len(target.cloud_m) or config.solver == "pnp"):
            raise InvalidInput("views", "no depth was measured on the object: this needs depth in at least one view, or the variant pnp")
        dims = component_count(config.dims, reference.basis.components.shape[1])
        needed = (True, config.solver != "pnp")
        pair = MatchedPair(reference, target, dims, config.correspondences, config.method, depth=needed)
        clock.lap("match")
        threshold_m = config.inlier_ratio * cloud_extent_m(target.cloud_m)
        estimate = self._solve(pair, reference.symmetries, threshold_m, seed, clock)
        if config.dof == 9:
            estimate = self._stretch(estimate, pair, Sim3.from_matrix(reference.box.world_from_object), threshold_m, seed)
            clock.lap("axis scales")
        return replace(estimate, matches=pair.among_all_patches(estimate.matches), stage_ms=clock.stage_ms)

    def _solve(self, pair: MatchedPair, symmetries: FloatArray, threshold_m: float, seed: int, clock: StageClock) -> PoseEstimate:
        config = self.config
        if config.solver == "retrieval":
            return by_retrieval(pair, config.consensus_deg, threshold_m, clock)
        if config.solver == "single view":
            return by_single_view(pair, ESTIMATORS[config.estimator], threshold_m, seed, clock)
        if config.solver == "umeyama":
            return by_consensus(pair, config.consensus_deg, ESTIMATORS[config.estimator], threshold_m, seed, clock)
        if config.solver == "pnp":
            return by_pnp(pair, config.inlier_ratio, seed, clock)
        return by_agreement(pair, config.best, symmetries, threshold_m, seed, clock)

    def _stretch(self, estimate: PoseEstimate, pair: MatchedPair, world_from_object: Sim3, threshold_m: float, seed: int) -> PoseEstimate:
        """9-D where that is determined, else 7-D as it was."""
        try:
            if self.config.solver == "agreement":
                transform = axis_scales_by_agreement(estimate, pair, self.config.best, world_from_object, seed)
            else:
                transform = axis_scales(estimate, pair, world_from_object, threshold_m)
        except NoPose as error:
            return replace(estimate, not_9d_because=str(error))
        return stretched(estimate, transform, pair, world_from_object, threshold_m)
