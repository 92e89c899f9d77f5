"""The 9-D transform: a rotation, a translation, and a scale of its own for each axis of the object's frame.

(Paper, appendix, "Replacing 7D similarity transform with 9D affine transform".) The paper writes v = diag(s) R u + t, which scales along
the axes of the target's world; those mean nothing to the object. Here the scale comes first, along the axes of the frame that the
reference's box defines, as in the categories' canonical spaces that the paper refers to: a box stays a box.

Letters: K correspondences; a leading * is any batch shape.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.errors import InvalidInput, NoPose
from core.sim3 import Sim3, homogeneous
from core.views import FloatArray

MIN_CORRESPONDENCES = 4
"""Fewer lie in one plane."""
PLANE_TOLERANCE = 1e-6
"""Smallest variance of the points over their largest below which they count as lying in one plane."""
ROUNDS = 200
"""Of refinement, at most."""
CONVERGED = 1e-10
"""Relative change of the scales in a round."""


@dataclass(frozen=True, eq=False)
class Affine9:
    """p_b = rotation · (scales ∘ p_a) + translation, for a transform named b_from_a whose a is an object's own frame.

    These transforms are no group: the inverse of one scales after it turns. What stays among them is a similarity after one of
    them (`then`), which is all that carrying an object through worlds needs.
    """

    scales: FloatArray
    """Of the axes of frame a, positive, shape (3,)."""
    rotation: FloatArray
    """Rotation matrix, shape (3, 3)."""
    translation: FloatArray
    """Metres of frame b, shape (3,)."""

    def __post_init__(self) -> None:
        if not (np.isfinite(self.scales).all() and (np.asarray(self.scales) > 0).all()):
            raise InvalidInput("scales", f"expected three positive numbers, found {np.asarray(self.scales).tolist()}")

    @staticmethod
    def from_similarity(b_from_a: Sim3) -> Affine9:
        """The same transform, with its one scale for every axis."""
        return Affine9(np.full(3, b_from_a.scale), b_from_a.rotation, b_from_a.translation)

    def as_matrix(self) -> FloatArray:
        """[[R diag(s), t], [0, 1]], shape (4, 4)."""
        return homogeneous(self.rotation * self.scales, self.translation)

    def apply(self, points: FloatArray) -> FloatArray:
        """Points of frame a, shape (*, 3), in frame b."""
        return points * self.scales @ self.rotation.T + self.translation

    def then(self, c_from_b: Sim3) -> Affine9:
        """c_from_a."""
        return Affine9(c_from_b.scale * self.scales, c_from_b.rotation @ self.rotation, c_from_b.apply(self.translation))

    def similarity(self) -> Sim3:
        """The similarity with the same rotation, the same image of the origin, and the same change of volume."""
        return Sim3(float(np.prod(self.scales) ** (1 / 3)), self.rotation, self.translation)


def fit_affine9(source: FloatArray, target: FloatArray, weights: FloatArray | None = None) -> Affine9:
    """target_from_source of least squares.

    In closed form first: the affine map of least squares, whose columns' lengths are the scales and whose nearest rotation is the
    rotation, which is exact where the points are. Then the rotation for given scales (Procrustes) and the scales for a given rotation
    (one division an axis) in turn, each of which only lowers the error.

    Args:
        source: points of the object's frame, shape (K, 3).
        target: their counterparts, shape (K, 3).
        weights: non-negative, shape (K,); equal where left out.

    Raises NoPose for fewer than four points, points in one plane, whose scale across it is not determined, and mirrored points.
    """
    if len(source) < MIN_CORRESPONDENCES:
        raise NoPose(f"a 9-D transform needs {MIN_CORRESPONDENCES} correspondences, found {len(source)}")
    weight = np.ones(len(source)) if weights is None else np.asarray(weights, dtype=float)
    weight = weight / weight.sum()
    source_mean, target_mean = weight @ source, weight @ target
    source_centred, target_centred = source - source_mean, target - target_mean
    spread = (source_centred * weight[:, None]).T @ source_centred
    cross = (target_centred * weight[:, None]).T @ source_centred
    for name, covariance in (("source", spread), ("target", (target_centred * weight[:, None]).T @ target_centred)):
        variances = np.linalg.eigvalsh(covariance)
        if variances[0] <= PLANE_TOLERANCE * variances[2]:
            raise NoPose(f"the {name} points of the correspondences lie in one plane, so the scale across it is not determined")
    affine = np.linalg.solve(spread, cross.T).T
    if np.linalg.det(affine) <= 0:
        raise NoPose("the correspondences are a reflection of each other; no 9-D transform fits them")
    scales = np.linalg.norm(affine, axis=0)
    rotation = _nearest_rotation(affine / scales)
    for _ in range(ROUNDS):
        before, scales = scales, _best_scales(rotation, cross, spread)
        rotation = _nearest_rotation(cross * scales)
        if np.abs(scales - before).max() <= CONVERGED * np.abs(scales).max():
            break
    return Affine9(scales, rotation, target_mean - rotation @ (scales * source_mean))


def _best_scales(rotation: FloatArray, cross: FloatArray, spread: FloatArray) -> FloatArray:
    """Of least squares for a given rotation. Raises NoPose where one of them is not positive."""
    scales = np.einsum("ik,ik->k", rotation, cross) / np.diag(spread)
    if not (scales > 0).all():
        raise NoPose("the correspondences are a reflection of each other along one axis; no 9-D transform fits them")
    return scales


def _nearest_rotation(matrix: FloatArray) -> FloatArray:
    u, _, vt = np.linalg.svd(matrix)
    return (u * np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])) @ vt
