"""COLMAP's robust similarity (LO-RANSAC on three points) in place of ours; needs the extra `colmap`."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from core.errors import Unavailable
from core.estimators.base import MIN_CORRESPONDENCES, Estimator, RobustFit, errors_m, no_agreement, require_enough
from core.sim3 import Sim3
from core.views import FloatArray


def lo_ransac(source: FloatArray, target: FloatArray, threshold_m: float, seed: int) -> RobustFit:
    """The similarity that `pycolmap.estimate_sim3d_robust` finds. See `Estimator`; raises Unavailable where pycolmap is not installed."""
    try:
        import pycolmap
    except ImportError as error:
        raise Unavailable("estimator 'pycolmap' needs pycolmap, which is not installed: pip install 'onelook[colmap]'") from error
    require_enough(source)
    options = pycolmap.RANSACOptions(max_error=threshold_m, random_seed=seed)
    found = pycolmap.estimate_sim3d_robust(np.asarray(source, dtype=np.float64), np.asarray(target, dtype=np.float64), options)
    if found is None or found["num_inliers"] < MIN_CORRESPONDENCES:
        raise no_agreement(source)
    similarity = found["tgt_from_src"]
    transform = Sim3(float(similarity.scale), np.asarray(similarity.rotation.matrix()), np.asarray(similarity.translation))
    return RobustFit.of(source, target, transform, errors_m(transform, source, target) < threshold_m)


OFFERS: Mapping[str, Estimator] = {"pycolmap": lo_ransac}
