"""Correspondences of chosen view pairs: pooled, marked as inliers or not, and what they join, points and rays.

Letters: K correspondences.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from core.correspond import PairMatches
from core.encode import EncodedView
from core.views import FloatArray


@dataclass(frozen=True, eq=False)
class Matches:
    """Correspondences of chosen view pairs."""

    reference_view: NDArray[np.intp]
    """Shape (K,)."""
    reference_patch: NDArray[np.intp]
    """Index into that view's `cells`, shape (K,)."""
    target_view: NDArray[np.intp]
    target_patch: NDArray[np.intp]
    similarity: FloatArray
    """Cosine, shape (K,)."""
    inlier: NDArray[np.bool_]
    """Whether each agrees with the transform, shape (K,)."""

    def __len__(self) -> int:
        return len(self.similarity)

    def best_pair(self, pairs: Sequence[tuple[int, int]]) -> tuple[int, int]:
        """The (reference view, target view) pair with the most inliers, the first of equals; `pairs` is not empty."""

        def inliers(pair: tuple[int, int]) -> int:
            return int((self.inlier & (self.reference_view == pair[0]) & (self.target_view == pair[1])).sum())

        return max(pairs, key=inliers)


def pool(found: PairMatches, pairs: Sequence[tuple[int, int]]) -> Matches:
    """The correspondences of some view pairs, all inliers until a fit says otherwise."""
    reference_view, target_view = (np.array([pair[side] for pair in pairs], dtype=np.intp) for side in (0, 1))
    valid = found.valid[reference_view, target_view].numpy()
    rows, _ = np.nonzero(valid)
    patches = [each[reference_view, target_view].numpy()[valid] for each in (found.reference_patch, found.target_patch, found.similarity)]
    return Matches(reference_view[rows], patches[0], target_view[rows], patches[1], patches[2], np.ones(len(rows), dtype=bool))


def end_points(matches: Matches, reference: Sequence[EncodedView], target: Sequence[EncodedView]) -> tuple[FloatArray, FloatArray]:
    """The matched points in the two worlds, each (K, 3)."""
    return (
        _gather(reference, matches.reference_view, matches.reference_patch),
        _gather(target, matches.target_view, matches.target_patch),
    )


def _gather(views: Sequence[EncodedView], view_index: NDArray[np.intp], patch: NDArray[np.intp]) -> FloatArray:
    starts = np.cumsum([0, *(len(view.points_m) for view in views)])[:-1]
    return np.concatenate([view.points_m for view in views])[starts[view_index] + patch]


def rays(view: EncodedView, patch: NDArray[np.intp]) -> FloatArray:
    """(x / z, y / z) of patches in the camera of their view, shape (K, 2)."""
    assert view.camera is not None, "whoever needs rays has asked for cameras"
    pixels = view.pixels[patch]
    return np.ascontiguousarray(view.camera.in_camera(pixels, np.ones(len(pixels)))[:, :2])
