"""Sim(3): similarity transforms of space, and their least-squares fit.

Letters: K correspondences; a leading * is any batch shape.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.errors import InvalidInput, NoPose
from core.views import ROTATION_TOLERANCE, FloatArray

RANK_TOLERANCE = 1e-6
"""Second singular value over the first below which points count as collinear."""


@dataclass(frozen=True, eq=False)
class Sim3:
    """p_b = scale · rotation · p_a + translation, for a transform named b_from_a."""

    scale: float
    rotation: FloatArray
    """Rotation matrix, shape (3, 3)."""
    translation: FloatArray
    """Metres of frame b, shape (3,)."""

    def __post_init__(self) -> None:
        if not (np.isfinite(self.scale) and self.scale > 0):
            raise InvalidInput("scale", f"expected a positive number, found {self.scale}")

    @staticmethod
    def identity() -> Sim3:
        """The neutral element."""
        return Sim3(1.0, np.eye(3), np.zeros(3))

    @staticmethod
    def turn_about(center: FloatArray, rotation: FloatArray) -> Sim3:
        """The rigid motion that turns by a rotation, shape (3, 3), about a point, shape (3,)."""
        return Sim3(1.0, rotation, center - rotation @ center)

    @staticmethod
    def from_matrix(matrix: FloatArray) -> Sim3:
        """From a 4×4 matrix [[λR, t], [0, 1]]. Raises InvalidInput where λR is no scaled rotation."""
        matrix = np.asarray(matrix, dtype=float)
        linear = matrix[:3, :3]
        determinant = float(np.linalg.det(linear))
        if determinant <= 0:
            raise InvalidInput("matrix", f"determinant is {determinant:.2g}; a similarity has a positive one")
        scale = determinant ** (1 / 3)
        if np.abs(linear.T @ linear / scale**2 - np.eye(3)).max() > ROTATION_TOLERANCE:
            raise InvalidInput("matrix", "its 3×3 block is not a rotation times one scale")
        return Sim3(scale, linear / scale, matrix[:3, 3])

    def as_matrix(self) -> FloatArray:
        """[[λR, t], [0, 1]], shape (4, 4)."""
        return homogeneous(self.scale * self.rotation, self.translation)

    @property
    def quaternion(self) -> FloatArray:
        """The rotation as (w, x, y, z) with w ≥ 0, shape (4,)."""
        return _quaternion(self.rotation)

    def apply(self, points: FloatArray) -> FloatArray:
        """Points of frame a, shape (*, 3), in frame b."""
        return self.scale * points @ self.rotation.T + self.translation

    def inverse(self) -> Sim3:
        """a_from_b."""
        rotation = self.rotation.T
        return Sim3(1 / self.scale, rotation, -(rotation @ self.translation) / self.scale)

    def __matmul__(self, other: Sim3) -> Sim3:
        """c_from_b @ b_from_a = c_from_a."""
        return Sim3(self.scale * other.scale, self.rotation @ other.rotation, self.apply(other.translation))


def homogeneous(linear: FloatArray, translation: FloatArray) -> FloatArray:
    """[[linear, translation], [0, 1]], shape (4, 4), from shapes (3, 3) and (3,)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = linear, translation
    return matrix


def _quaternion(rotation: FloatArray) -> FloatArray:
    """(w, x, y, z) with w ≥ 0 of a rotation matrix, shape (3, 3): the eigenvector of largest eigenvalue of Bar-Itzhack's matrix (2000).

    By numpy alone, since a robot's client has no SciPy.
    """
    trace = np.trace(rotation)
    axis = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    symmetric = np.empty((4, 4))
    symmetric[0, 0] = trace
    symmetric[0, 1:] = symmetric[1:, 0] = axis
    symmetric[1:, 1:] = rotation + rotation.T - trace * np.eye(3)
    quaternion = np.linalg.eigh(symmetric)[1][:, -1]
    leading = quaternion[np.abs(quaternion) > 1e-12][0]
    return np.asarray(quaternion * np.sign(leading))


def rotation_angle_deg(first: FloatArray, second: FloatArray) -> FloatArray:
    """Geodesic angle in degrees between rotations, shapes (*, 3, 3)."""
    trace = np.einsum("...ij,...ij->...", first, second)
    return np.degrees(np.arccos(np.clip((trace - 1) / 2, -1, 1)))


def umeyama(source: FloatArray, target: FloatArray, weights: FloatArray | None = None) -> Sim3:
    """target_from_source: the similarity of least squares (Umeyama 1991; paper, "Final pose estimation").

    Args:
        source, target: corresponding points, shape (K, 3).
        weights: non-negative, shape (K,); equal where left out.

    Raises NoPose for fewer than three points or collinear ones, whose rotation is not determined.
    """
    if len(source) < 3:
        raise NoPose(f"a similarity needs three correspondences, found {len(source)}")
    weight = np.ones(len(source)) if weights is None else np.asarray(weights, dtype=float)
    weight = weight / weight.sum()
    source_mean, target_mean = weight @ source, weight @ target
    source_centred, target_centred = source - source_mean, target - target_mean
    covariance = (target_centred * weight[:, None]).T @ source_centred
    variance = float(weight @ (source_centred**2).sum(axis=1))
    u, singular, vt = np.linalg.svd(covariance)
    if singular[1] <= RANK_TOLERANCE * singular[0]:
        raise NoPose("the correspondences lie on one line or point, so their rotation is not determined")
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation = (u * signs) @ vt
    scale = float((singular * signs).sum() / variance)  # positive: singular values fall, and the first is above 0
    return Sim3(scale, rotation, target_mean - scale * rotation @ source_mean)
