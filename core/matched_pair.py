"""A reference and a target, ready to be laid on each other: described in one basis, every view pair matched.

Letters: M reference views, N target views, Q view pairs, P points.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from core.correspond import PairMatches, PatchSet, match
from core.descriptors import unit
from core.encode import EncodedBurst, EncodedView
from core.reference import Reference
from core.viewpoints import best_reference_per_target, relative_rotations
from core.views import FloatArray

Pairs = list[tuple[int, int]]
"""(reference view, target view)"""


class MatchedPair:
    """Trusted patches only: what has no measured depth carries no geometry."""

    def __init__(self, reference: Reference, target: EncodedBurst, dims: int | None, correspondences: int, method: str) -> None:
        """`dims`, `correspondences` and `method` as in `PoseConfig`."""
        self.reference = [view.trusted_only() for view in reference.views]
        self.target = [view.trusted_only() for view in target.views]
        self.descriptors = _describe(self.reference, reference, dims), _describe(self.target, reference, dims)
        sides = [_patches(views, vectors, method) for views, vectors in zip((self.reference, self.target), self.descriptors)]
        self.found: PairMatches = match(sides[0], sides[1], correspondences, method)
        self.similarity: FloatArray = self.found.view_similarity().numpy()
        """S, shape (M, N)."""
        self.relative = relative_rotations(self.reference, self.target)
        """target_from_reference of each view pair, if it showed its objects from the same side, shape (M, N, 3, 3)."""

    @cached_property
    def clouds(self) -> tuple[FloatArray, FloatArray]:
        """All points of the reference and of the target, each (P, 3)."""
        of_reference, of_target = (np.concatenate([view.points_m for view in views]) for views in (self.reference, self.target))
        return of_reference, of_target

    def best_pairs(self) -> Pairs:
        """Every target view with its most similar reference view, where anything matched."""
        return [each for each in best_reference_per_target(self.similarity) if self.similarity[each] > 0]

    def rotations(self, pairs: Pairs) -> FloatArray:
        """`relative` of some pairs, shape (Q, 3, 3)."""
        return np.stack([self.relative[each] for each in pairs])

    def similarities(self, pairs: Pairs) -> FloatArray:
        """`similarity` of some pairs, shape (Q,)."""
        return np.array([self.similarity[each] for each in pairs])


def _describe(views: Sequence[EncodedView], reference: Reference, dims: int | None) -> list[FloatArray]:
    """Unit descriptors of each view's patches, along the reference's first `dims` components."""
    return [unit(view.descriptors if dims is None else reference.basis.project(view.descriptors, dims)) for view in views]


def _patches(views: Sequence[EncodedView], vectors: Sequence[FloatArray], method: str) -> PatchSet:
    places = [view.points_m if method == "cyclical-3d" else view.cells.astype(np.float32) for view in views]
    return PatchSet.pad(vectors, places)
