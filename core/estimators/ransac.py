"""RANSAC with Umeyama's similarity on four points, all trials in one batch (paper, "Final pose estimation")."""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray

from core.errors import NoPose
from core.estimators.base import MIN_CORRESPONDENCES, FloatArray, RobustFit, refit
from core.estimators.batched import umeyama_batch
from core.sim3 import Sim3, umeyama

TRIALS = 1000
MAX_SCALE = 4.0
"""Objects of one category differ in size by less than this; a sample of near-coincident points does not."""
REFITS = 3
"""Rounds of least squares on the inliers."""


def ransac(source: FloatArray, target: FloatArray, threshold_m: float, seed: int, *, trials: int = TRIALS) -> RobustFit:
    """The similarity with the largest inlier set, refitted to it. See `Estimator`."""
    count = len(source)
    if count < MIN_CORRESPONDENCES:
        raise NoPose(f"{count} correspondences with measured depth; at least {MIN_CORRESPONDENCES} are needed: send more views or better depth")
    sample = np.random.default_rng(seed).random((trials, count)).argpartition(MIN_CORRESPONDENCES - 1, axis=1)[:, :MIN_CORRESPONDENCES]
    points, aims = torch.from_numpy(source.astype(np.float64)), torch.from_numpy(target.astype(np.float64))
    scale, rotation, translation, determined = umeyama_batch(points[sample], aims[sample])
    determined &= (scale < MAX_SCALE) & (scale > 1 / MAX_SCALE)
    if not determined.any():
        raise NoPose("every sample of correspondences is collinear or absurdly scaled; the views may show too little of the object")
    moved = scale[:, None, None] * (points @ rotation.transpose(1, 2)) + translation[:, None]
    inliers = (torch.linalg.norm(moved - aims, dim=-1) < threshold_m) & determined[:, None]
    best = int(inliers.sum(dim=1).argmax())
    start = Sim3(float(scale[best]), rotation[best].numpy(), translation[best].numpy())
    return _polish(source, target, start, inliers[best].numpy(), threshold_m)


def _polish(source: FloatArray, target: FloatArray, transform: Sim3, inlier: NDArray[np.bool_], threshold_m: float) -> RobustFit:
    """Least squares on the inliers while that does not lose inliers."""
    for _ in range(REFITS):
        try:
            refined = umeyama(source[inlier], target[inlier])
        except NoPose:
            break
        again = np.linalg.norm(refined.apply(source) - target, axis=1) < threshold_m
        if again.sum() < inlier.sum():
            break
        transform, inlier = refined, again
    return refit(source, target, transform, inlier)
