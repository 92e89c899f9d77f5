"""The pose pipeline: descriptors of a reference and a burst in, a 7-D transform out; every variant is a config.

Letters: M reference views, N target views, K correspondences.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from core.boxes import cloud_extent_m
from core.clock import StageClock
from core.correspond import METHODS, PairMatches, PatchSet, match
from core.descriptors import unit
from core.encode import EncodedBurst, EncodedView
from core.errors import InvalidInput
from core.estimators.base import FloatArray, RobustFit
from core.estimators.ransac import ransac
from core.reference import Reference
from core.sim3 import Sim3
from core.viewpoints import best_reference_per_target, consensus, relative_rotations


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

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise InvalidInput("method", f"{self.method!r} is none of {', '.join(METHODS)}")

    @staticmethod
    def named(variant: str) -> PoseConfig:
        """The config of a variant of the paper's table 1. Raises InvalidInput for an unknown name."""
        if variant not in VARIANTS:
            raise InvalidInput("variant", f"{variant!r} is none of {', '.join(VARIANTS)}")
        return VARIANTS[variant]


_UCD = PoseConfig()
VARIANTS = {
    "ucd": _UCD,
    "ud": replace(_UCD, variant="ud", consensus_deg=None),
    "uc": replace(_UCD, variant="uc", dims=None),
    "u": replace(_UCD, variant="u", dims=None, consensus_deg=None),
}
"""R: retrieval, C: consensus, U: Umeyama, D: reduced descriptors."""


@dataclass(frozen=True, eq=False)
class Matches:
    """Correspondences that the transform was fitted to."""

    reference_view: NDArray[np.intp]
    """Shape (K,)."""
    reference_patch: NDArray[np.intp]
    """Index into that view's `cells`, shape (K,)."""
    target_view: NDArray[np.intp]
    target_patch: NDArray[np.intp]
    similarity: FloatArray
    """Cosine, shape (K,)."""
    inlier: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.similarity)


@dataclass(frozen=True, eq=False)
class Alternative:
    """Another pose that explains the views nearly as well."""

    target_from_reference: Sim3
    score: float


@dataclass(frozen=True, eq=False)
class PoseEstimate:
    """A target's pose and what it rests on."""

    target_from_reference: Sim3
    matches: Matches
    view_similarity: FloatArray
    """S, shape (M, N)."""
    pairs: tuple[tuple[int, int], ...]
    """(reference view, target view) pairs whose correspondences were used."""
    residual_m: float
    confidence: float | None = None
    """Probability that the rotation is within 30°, where the variant estimates one."""
    alternatives: tuple[Alternative, ...] = ()
    stage_ms: dict[str, float] = field(default_factory=dict)

    @property
    def inliers(self) -> int:
        """Correspondences that agree with the transform."""
        return int(self.matches.inlier.sum())


class PoseEstimator:
    """Estimates `target_from_reference` with one config."""

    def __init__(self, config: PoseConfig | None = None) -> None:
        self.config = config or PoseConfig()

    def estimate(self, reference: Reference, target: EncodedBurst, *, seed: int = 0) -> PoseEstimate:
        """The similarity from the reference scan's world to the burst's world.

        Raises InvalidInput for tokens of another backbone or views without cameras or depth, NoPose where nothing fits.
        """
        require_comparable(reference, target)
        clock = StageClock()
        reference_views = [view.trusted_only() for view in reference.views]
        target_views = [view.trusted_only() for view in target.views]
        found = match(self._patches(reference, reference_views), self._patches(reference, target_views), self.config.correspondences, self.config.method)
        similarity = found.view_similarity().numpy()
        clock.lap("match")
        pairs = self._choose_pairs(similarity, reference_views, target_views, seed)
        clock.lap("views")
        chosen = _pool(found, pairs)
        source, aim = _points(reference_views, chosen.reference_view, chosen.reference_patch), _points(target_views, chosen.target_view, chosen.target_patch)
        fit = ransac(source, aim, self.config.inlier_ratio * cloud_extent_m(target.cloud_m), seed)
        clock.lap("solve")
        matches = _to_all_patches(replace(chosen, inlier=fit.inlier), reference.views, target.views)
        return PoseEstimate(fit.target_from_reference, matches, similarity, tuple(pairs), fit.residual_m, stage_ms=clock.stage_ms)

    def _patches(self, reference: Reference, views: Sequence[EncodedView]) -> PatchSet:
        dims = self.config.dims
        tokens = [view.descriptors if dims is None else reference.basis.project(view.descriptors, dims) for view in views]
        places = [view.points_m if self.config.method == "cyclical-3d" else view.cells.astype(np.float32) for view in views]
        return PatchSet.pad([unit(each) for each in tokens], places)

    def _choose_pairs(
        self, similarity: FloatArray, reference: Sequence[EncodedView], target: Sequence[EncodedView], seed: int
    ) -> list[tuple[int, int]]:
        pairs = [pair for pair in best_reference_per_target(similarity) if similarity[pair] > 0]
        if self.config.consensus_deg is None or not pairs:
            return pairs
        rotations = relative_rotations(reference, target)
        agree = consensus(np.stack([rotations[pair] for pair in pairs]), self.config.consensus_deg, seed)
        return [pair for pair, kept in zip(pairs, agree) if kept]


def require_comparable(reference: Reference, target: EncodedBurst) -> None:
    """Raises InvalidInput where descriptors, cameras or depth do not allow a 7-D pose."""
    if reference.fingerprint != target.fingerprint:
        raise InvalidInput("reference", f"was made with backbone {reference.fingerprint}, the burst with {target.fingerprint}; their tokens cannot be compared")
    for index, view in enumerate(target.views):
        if view.camera is None:
            raise InvalidInput(f"views[{index}].K", "is missing: a pose needs K and world_from_camera for every view")
    if not len(target.cloud_m):
        raise InvalidInput("views", "no depth was measured on the object: a 7-D pose needs depth in at least one view")


def _pool(found: PairMatches, pairs: Sequence[tuple[int, int]]) -> Matches:
    """The correspondences of some view pairs, all inliers until a fit says otherwise."""
    reference_view, target_view = (np.array([pair[side] for pair in pairs], dtype=np.intp) for side in (0, 1))
    valid = found.valid[reference_view, target_view].numpy()
    rows, _ = np.nonzero(valid)
    patches = [each[reference_view, target_view].numpy()[valid] for each in (found.reference_patch, found.target_patch, found.similarity)]
    return Matches(reference_view[rows], patches[0], target_view[rows], patches[1], patches[2], np.ones(len(rows), dtype=bool))


def _points(views: Sequence[EncodedView], view_index: NDArray[np.intp], patch: NDArray[np.intp]) -> FloatArray:
    if not len(view_index):
        return np.zeros((0, 3))
    return np.stack([views[view].points_m[index] for view, index in zip(view_index, patch)])


def _to_all_patches(matches: Matches, reference: Sequence[EncodedView], target: Sequence[EncodedView]) -> Matches:
    """Patch indices among the trusted patches become indices among all of a view's patches."""

    def lift(views: Sequence[EncodedView], view_index: NDArray[np.intp], patch: NDArray[np.intp]) -> NDArray[np.intp]:
        trusted = [np.flatnonzero(view.trusted) for view in views]
        return np.array([trusted[view][index] for view, index in zip(view_index, patch)], dtype=np.intp)

    return replace(
        matches,
        reference_patch=lift(reference, matches.reference_view, matches.reference_patch),
        target_patch=lift(target, matches.target_view, matches.target_patch),
    )
