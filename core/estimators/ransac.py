"""RANSAC with Umeyama's similarity on four points, all trials in one batch (paper, "Final pose estimation").

Letters: K correspondences, T trials that determine a similarity.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from core.errors import NoPose
from core.estimators.base import MAX_SCALE, MIN_CORRESPONDENCES, Estimator, RobustFit, errors_m, no_agreement, require_enough
from core.estimators.batched import Sim3Batch, umeyama_batch
from core.sim3 import Sim3, umeyama
from core.views import FloatArray

TRIALS = 1000
"""Samples of four correspondences."""
REFITS = 3
"""Rounds of least squares on the inliers."""


def ransac(source: FloatArray, target: FloatArray, threshold_m: float, seed: int) -> RobustFit:
    """The similarity with the largest inlier set, refitted to it. See `Estimator`."""
    require_enough(source)
    trials, inliers = sample(source, target, threshold_m, TRIALS, seed)
    if not len(trials):
        raise NoPose("every sample of correspondences is collinear or absurdly scaled; the views may show too little of the object")
    best = int(inliers.sum(dim=1).argmax())
    if inliers[best].sum() < MIN_CORRESPONDENCES:
        raise no_agreement(source)
    return polish(source, target, trials[best], inliers[best].numpy(), threshold_m)


def sample(source: FloatArray, target: FloatArray, threshold_m: float, trials: int, seed: int) -> tuple[Sim3Batch, Tensor]:
    """Similarities of random samples, the undetermined ones left out, and their inliers, shape (T, K), from shapes (K, 3), K ≥ 4."""
    chosen = _without_repeats(np.random.default_rng(seed), trials, len(source))
    points, aims = torch.from_numpy(source.astype(np.float64)), torch.from_numpy(target.astype(np.float64))
    transforms, determined = umeyama_batch(points[chosen], aims[chosen])
    determined &= (transforms.scale < MAX_SCALE) & (transforms.scale > 1 / MAX_SCALE)
    transforms = transforms.select(determined.nonzero().flatten())
    return transforms, transforms.squared_errors(points, aims) < threshold_m**2


def _without_repeats(rng: np.random.Generator, trials: int, count: int) -> NDArray[np.intp]:
    """Samples of MIN_CORRESPONDENCES different numbers below `count`, shape (trials, 4), all as likely (Floyd's algorithm)."""
    chosen = np.empty((trials, MIN_CORRESPONDENCES), dtype=np.intp)
    for column, last in enumerate(range(count - MIN_CORRESPONDENCES, count)):
        drawn = rng.integers(0, last + 1, trials)
        repeated = (chosen[:, :column] == drawn[:, None]).any(axis=1)
        chosen[:, column] = np.where(repeated, last, drawn)
    return chosen


def polish(source: FloatArray, target: FloatArray, transform: Sim3, inlier: NDArray[np.bool_], threshold_m: float) -> RobustFit:
    """Least squares on the inliers while that lowers the squared errors, each of at most the threshold's: a transform that is bent to
    reach one more inlier has more of them, and is worse.

    `source` and `target`: shape (K, 3); `inlier`, of the transform to begin with: shape (K,).
    """
    cost = (np.minimum(errors_m(transform, source, target), threshold_m) ** 2).sum()
    for _ in range(REFITS):
        try:
            refined = umeyama(source[inlier], target[inlier])
        except NoPose:
            break
        errors = errors_m(refined, source, target)
        lower = (np.minimum(errors, threshold_m) ** 2).sum()
        if lower >= cost:
            break
        transform, inlier, cost = refined, errors < threshold_m, lower
    return RobustFit.of(source, target, transform, inlier)


OFFERS: Mapping[str, Estimator] = {"ransac": ransac}
