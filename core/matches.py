"""What a pose estimate is made of: correspondences, the transform, its rivals.

Letters: M reference views, N target views, K correspondences.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from core.affine9 import Affine9
from core.boxes import OrientedBox
from core.correspond import PairMatches
from core.encode import EncodedView
from core.sim3 import Sim3
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


@dataclass(frozen=True, eq=False)
class Alternative:
    """Another pose that explains the views nearly as well."""

    target_from_reference: Sim3
    score: float
    confidence: float | None = None
    """As the estimate's."""


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
    """Root mean square distance over the inliers, metres of the target."""
    score: float | None = None
    """How well the pose explains both objects (`core.dense`, times the agreement of view pairs), where the variant computes it."""
    confidence: float | None = None
    """Probability that the rotation is within 30° (`core.confidence`), where the variant estimates one."""
    alternatives: tuple[Alternative, ...] = ()
    target_from_object: Affine9 | None = None
    """From the frame of the reference's box, with a scale for each of its axes, where 9-D was asked for and is determined.
    `target_from_reference` is then its similarity."""
    not_9d_because: str | None = None
    """Why there is none though it was asked for."""
    stage_ms: dict[str, float] = field(default_factory=dict)

    @property
    def inliers(self) -> int:
        """Correspondences that agree with the transform."""
        return int(self.matches.inlier.sum())

    def matrix(self, reference_box: OrientedBox) -> FloatArray:
        """From the reference's world to the target's, shape (4, 4): 9-D where the pose is."""
        if self.target_from_object is None:
            return self.target_from_reference.as_matrix()
        return self.target_from_object.as_matrix() @ np.linalg.inv(reference_box.world_from_object)

    def box(self, of_reference: OrientedBox) -> OrientedBox:
        """The reference's box on the target, stretched along its axes where the pose is 9-D."""
        if self.target_from_object is None:
            return of_reference.moved_by(self.target_from_reference)
        return of_reference.stretched_by(self.target_from_object)


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
