"""What every robust estimator gives back.

Letters: K correspondences.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from core.sim3 import Sim3

FloatArray = NDArray[np.floating]
MIN_CORRESPONDENCES = 4
"""Points a hypothesis is fitted to (paper, "Final pose estimation")."""


@dataclass(frozen=True, eq=False)
class RobustFit:
    """A similarity and the correspondences that agree with it."""

    target_from_reference: Sim3
    inlier: NDArray[np.bool_]
    """Shape (K,)."""
    residual_m: float
    """Root mean square distance over the inliers, metres of the target."""


class Estimator(Protocol):
    """Fits a similarity to correspondences of which many are wrong. Deterministic for a seed."""

    def __call__(self, source: FloatArray, target: FloatArray, threshold_m: float, seed: int) -> RobustFit:
        """From shapes (K, 3), (K, 3). Raises NoPose where no hypothesis can be formed."""
        ...


def refit(source: FloatArray, target: FloatArray, transform: Sim3, inlier: NDArray[np.bool_]) -> RobustFit:
    """The result for a final transform and its inlier set."""
    errors = np.linalg.norm(transform.apply(source) - target, axis=1)[inlier]
    return RobustFit(transform, inlier, float(np.sqrt((errors**2).mean())) if errors.size else 0.0)
