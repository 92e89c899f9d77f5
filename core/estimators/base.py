"""What a robust estimator is given, gives back and refuses.

A file beside this one offers an estimator by the name that options call it: `OFFERS: Mapping[str, Estimator] = {"name": function}`.
tests/core/test_estimators.py and tests/core/test_pose.py try all that are offered; what is its own goes into a test_NAME.py beside them.
The variant `best` makes no use of an estimator, `ucd` does: docs/method.md, "Options", says which variants do.

Letters: K correspondences.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from core.affine9 import Affine9
from core.errors import NoPose
from core.sim3 import Sim3
from core.views import FloatArray

MIN_CORRESPONDENCES = 4
"""Points a hypothesis is fitted to (paper, "Final pose estimation")."""
MAX_SCALE = 4.0
"""Objects of one category differ in size by less than this; a sample of near-coincident points does not."""


@dataclass(frozen=True, eq=False)
class RobustFit:
    """A similarity and the correspondences that agree with it."""

    target_from_reference: Sim3
    inlier: NDArray[np.bool_]
    """Shape (K,)."""
    residual_m: float
    """Root mean square distance over the inliers, metres of the target."""

    @staticmethod
    def of(source: FloatArray, target: FloatArray, transform: Sim3, inlier: NDArray[np.bool_]) -> RobustFit:
        """The result for a final transform and its inlier set, of shape (K,)."""
        return RobustFit(transform, inlier, root_mean_square(errors_m(transform, source, target)[inlier]))


class Estimator(Protocol):
    """Fits a similarity to correspondences of which 60 % and more may be wrong. Deterministic for a seed."""

    def __call__(self, source: FloatArray, target: FloatArray, threshold_m: float, seed: int) -> RobustFit:
        """From shapes (K, 3), (K, 3). One agrees with a transform that carries it nearer than `threshold_m`, metres of the target.

        Raises NoPose where fewer than MIN_CORRESPONDENCES are given or agree (`require_enough`, `no_agreement`), and Unavailable where a
        library that comes with an extra, imported in the function, is not installed.
        """
        ...


def require_enough(source: FloatArray) -> None:
    """Raises NoPose for fewer than MIN_CORRESPONDENCES, from shape (K, 3)."""
    if len(source) < MIN_CORRESPONDENCES:
        raise NoPose(
            f"{len(source)} correspondences with measured depth; at least {MIN_CORRESPONDENCES} are needed: send more views or better depth"
        )


def no_agreement(source: FloatArray) -> NoPose:
    """The error where fewer than MIN_CORRESPONDENCES of those given, shape (K, 3), agree."""
    return NoPose(f"no {MIN_CORRESPONDENCES} of {len(source)} correspondences agree on a transform; are these objects of one kind?")


def errors_m(target_from_source: Sim3 | Affine9, source: FloatArray, target: FloatArray) -> FloatArray:
    """How far each transformed point is from its counterpart, metres of the target, shape (K,), from shapes (K, 3)."""
    return np.asarray(np.linalg.norm(target_from_source.apply(source) - target, axis=1))


def root_mean_square(errors: FloatArray) -> float:
    """Of shape (K,); 0 of none."""
    return float(np.sqrt((errors**2).mean())) if errors.size else 0.0
