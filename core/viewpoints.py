"""From matches of view pairs to view pairs that agree on a rotation (paper, "Aggregating multi-view correspondences").

Letters: M reference views, N target views, Q view pairs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from core.encode import EncodedView
from core.errors import InvalidInput
from core.views import FloatArray

ROTATION_SAMPLES = 10_000
"""Random rotations tried for a consensus: about 75 fall within 30° of any given one."""


def best_reference_per_target(view_similarity: FloatArray) -> list[tuple[int, int]]:
    """For each target view the reference view of largest similarity: N pairs (reference, target) from shape (M, N)."""
    return [(int(reference), target) for target, reference in enumerate(view_similarity.argmax(axis=0))]


def world_from_crop(view: EncodedView) -> FloatArray:
    """Rotation (3, 3) of the camera turned so that its axis goes through the crop's centre.

    Two crops look alike when the object is seen from the same side, wherever it was in the image.
    """
    if view.camera is None:
        raise InvalidInput("views", "a pose needs world_from_camera for every view")
    centre = view.window.to_pixels(np.zeros((1, 2)), 1)[0]
    ray = np.linalg.solve(view.camera.K, np.array([*centre, 1.0]))
    turn, _ = Rotation.align_vectors(ray[None] / np.linalg.norm(ray), np.array([[0.0, 0.0, 1.0]]))
    return np.asarray(view.camera.world_from_camera[:3, :3] @ turn.as_matrix())


def relative_rotations(reference: Sequence[EncodedView], target: Sequence[EncodedView]) -> FloatArray:
    """target_from_reference rotations, shape (M, N, 3, 3), if each pair showed its object from the very same side."""
    of_reference = np.stack([world_from_crop(view) for view in reference])
    of_target = np.stack([world_from_crop(view) for view in target])
    return np.asarray(np.einsum("nij,mkj->mnik", of_target, of_reference))


def angles_deg(rotations: FloatArray, others: FloatArray) -> FloatArray:
    """Angle between every two rotations, shape (Q, R), from shapes (Q, 3, 3) and (R, 3, 3)."""
    traces = rotations.reshape(-1, 9) @ others.reshape(-1, 9).T
    return np.degrees(np.arccos(np.clip((traces - 1) / 2, -1, 1)))


def consensus(rotations: FloatArray, similarity: FloatArray, angle_deg: float, seed: int) -> NDArray[np.bool_]:
    """The largest set within `angle_deg` of one of many random rotations, shape (Q,); of sets as large, the most similar pairs.

    Args:
        rotations: of the view pairs, shape (Q, 3, 3).
        similarity: S of the pairs, shape (Q,). With ten views sets of equal size are common, and front and back are often such a pair.
    """
    samples = Rotation.random(ROTATION_SAMPLES, rng=seed).as_matrix()
    near = angles_deg(rotations, samples) < angle_deg
    tie_break = similarity / max(float(similarity.sum()), 1e-9) / 2
    return np.asarray(near[:, int((near * (1 + tie_break[:, None])).sum(axis=0).argmax())])


def mean_rotation(rotations: FloatArray) -> FloatArray:
    """The chordal mean of rotations, shape (3, 3), from shape (Q, 3, 3)."""
    return np.asarray(Rotation.from_matrix(rotations).mean().as_matrix())


def near_their_mean(rotations: FloatArray, angle_deg: float) -> NDArray[np.bool_]:
    """The rotations, shape (Q,) of (Q, 3, 3), left when the farthest from the mean is removed until all are within `angle_deg` of it."""
    kept = np.ones(len(rotations), dtype=bool)
    while True:
        off = angles_deg(rotations, mean_rotation(rotations[kept])[None])[:, 0] * kept
        if off.max() <= angle_deg:
            return kept
        kept[off.argmax()] = False


def view_agreement(rotations: FloatArray, relative: FloatArray, view_similarity: FloatArray, angle_deg: float) -> FloatArray:
    """How much more similar than others the view pairs are that a rotation brings together, shape (T,).

    The similarities of each target view are standardised over the reference views, and lose what a reference view has in common with
    all target views: the light of a room from one side, or a place from which little of an object is seen. They are then averaged with
    weights that fall off with the angle between a pair's relative rotation and the one asked about. It tells front from back where
    single patches cannot.

    Args:
        rotations: target_from_reference, shape (T, 3, 3).
        relative: of `relative_rotations`, shape (M, N, 3, 3).
        view_similarity: S, shape (M, N); views that were not matched, at 0, say nothing.
    """
    known = view_similarity > 0
    standard = np.where(known, view_similarity - _mean(view_similarity, known, 0), 0.0)
    spread = np.sqrt(_mean(standard**2, known, 0))
    standard = standard / np.where(spread > 0, spread, 1.0)
    if standard.shape[1] > 1:
        standard = np.where(known, standard - _mean(standard, known, 1), 0.0)
    weights = np.exp(-((angles_deg(rotations, relative.reshape(-1, 3, 3)) / angle_deg) ** 2)) * known.ravel()
    return weights @ standard.ravel() / np.maximum(weights.sum(axis=1), 1e-6)


def _mean(values: FloatArray, known: NDArray[np.bool_], axis: int) -> FloatArray:
    """Of what is known along an axis, which stays; 0 where nothing is."""
    return np.asarray((values * known).sum(axis=axis, keepdims=True) / np.maximum(known.sum(axis=axis, keepdims=True), 1))
