"""A reference and a target, ready to be laid on each other: described in one basis, every view pair matched.

Letters: M reference views, N target views, Q view pairs, P patches of a view, C descriptor size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from core.correspond import PairMatches, PatchSet, match
from core.descriptors import PcaBasis, unit
from core.discriminant import discriminant_directions
from core.encode import EncodedBurst, EncodedView
from core.errors import InvalidInput
from core.matches import Matches
from core.surface import Surface
from core.viewpoints import best_reference_per_target, relative_rotations
from core.views import FloatArray, require_camera

Pairs = list[tuple[int, int]]
"""(reference view, target view)"""
CANDIDATES = 10
"""Reference views that a target view is matched with: time then grows with the number of views, and not with that of pairs."""
STEADY_DIMS = 32
"""Size of the descriptors that change little from view to view."""


class Described(Protocol):
    """What matching needs of a reference."""

    @property
    def views(self) -> tuple[EncodedView, ...]: ...

    @property
    def basis(self) -> PcaBasis: ...

    @property
    def fingerprint(self) -> str: ...


def require_comparable(reference: Described, target: EncodedBurst) -> None:
    """Raises InvalidInput for tokens of another backbone or a target view without a camera."""
    if reference.fingerprint != target.fingerprint:
        raise InvalidInput(
            "reference",
            f"was made with backbone {reference.fingerprint}, the burst with {target.fingerprint}; their tokens cannot be compared",
        )
    for index, view in enumerate(target.views):
        require_camera(view.camera, index)


class MatchedPair:
    """Trusted patches only, where depth is asked for: what has no measured depth carries no geometry."""

    def __init__(
        self,
        reference: Described,
        target: EncodedBurst,
        dims: int | None,
        correspondences: int,
        method: str,
        *,
        depth: tuple[bool, bool] = (True, True),
    ) -> None:
        """`dims`, `correspondences` and `method` as in `PoseConfig`; `depth` says of which side, reference and target, patches without
        it are left out."""
        self.kept = tuple(
            [np.flatnonzero(view.trusted) if measured else np.arange(len(view.cells)) for view in views]
            for views, measured in zip((reference.views, target.views), depth)
        )
        """Indices among all of a view's patches, one array a view, of the reference and of the target."""
        self.reference, self.target = (
            [view.trusted_only() if measured else view for view in views] for views, measured in zip((reference.views, target.views), depth)
        )
        self._basis = reference.basis
        self.fingerprint = reference.fingerprint
        """The backbone's."""
        self.descriptors = describe(self.reference, reference, dims), describe(self.target, reference, dims)
        sides = [_patches(views, vectors, method) for views, vectors in zip((self.reference, self.target), self.descriptors)]
        self.found: PairMatches = match(sides[0], sides[1], correspondences, method, _alike(*self.descriptors))
        self.similarity: FloatArray = self.found.view_similarity().numpy()
        """S, shape (M, N); 0 where views were not matched."""
        self.relative = relative_rotations(self.reference, self.target)
        """target_from_reference of each view pair, if it showed its objects from the same side, shape (M, N, 3, 3)."""

    @cached_property
    def surfaces(self) -> tuple[Surface, Surface]:
        """Of the reference and of the target."""
        return Surface(self.reference), Surface(self.target)

    @cached_property
    def steady_descriptors(self) -> tuple[list[FloatArray], list[FloatArray]]:
        """Unit descriptors that change little from view to view, of the reference and of the target: one array a view, shape (P, C), of at
        most STEADY_DIMS dimensions."""
        directions = discriminant_directions((self.reference, self.target), STEADY_DIMS)
        of_reference, of_target = (
            [unit(np.asarray((view.descriptors - self._basis.mean) @ directions, dtype=np.float32)) for view in views]
            for views in (self.reference, self.target)
        )
        return of_reference, of_target

    def among_all_patches(self, matches: Matches) -> Matches:
        """The same correspondences, with indices among all of a view's patches."""

        def lift(kept: list[NDArray[np.intp]], view: NDArray[np.intp], patch: NDArray[np.intp]) -> NDArray[np.intp]:
            return np.array([kept[each][index] for each, index in zip(view, patch)], dtype=np.intp)

        return replace(
            matches,
            reference_patch=lift(self.kept[0], matches.reference_view, matches.reference_patch),
            target_patch=lift(self.kept[1], matches.target_view, matches.target_patch),
        )

    def best_pairs(self) -> Pairs:
        """Every target view with its most similar reference view, where anything matched."""
        return [each for each in best_reference_per_target(self.similarity) if self.similarity[each] > 0]

    def rotations(self, pairs: Pairs) -> FloatArray:
        """`relative` of some pairs, shape (Q, 3, 3)."""
        return np.stack([self.relative[each] for each in pairs])

    def similarities(self, pairs: Pairs) -> FloatArray:
        """`similarity` of some pairs, shape (Q,)."""
        return np.array([self.similarity[each] for each in pairs])


def describe(views: Sequence[EncodedView], reference: Described, dims: int | None) -> list[FloatArray]:
    """Unit descriptors along the reference's first `dims` components, of whole tokens for None: one array a view, shape (P, C)."""
    return [unit(view.descriptors if dims is None else reference.basis.project(view.descriptors, dims)) for view in views]


def _alike(reference: Sequence[FloatArray], target: Sequence[FloatArray]) -> Pairs:
    """For every target view the reference views whose mean descriptors are most like its own, CANDIDATES at most."""
    of_reference, of_target = (
        unit(np.stack([vectors.sum(axis=0) if len(vectors) else np.zeros(vectors.shape[1]) for vectors in side]))
        for side in (reference, target)
    )
    nearest = np.argsort(-(of_target @ of_reference.T), axis=1, kind="stable")[:, :CANDIDATES]
    return [(int(m), n) for n, row in enumerate(nearest) for m in row]


def _patches(views: Sequence[EncodedView], vectors: Sequence[FloatArray], method: str) -> PatchSet:
    places = [view.points_m if method == "cyclical-3d" else view.cells.astype(np.float32) for view in views]
    return PatchSet.of(vectors, places)
