"""The estimators by name."""

from __future__ import annotations

from collections.abc import Mapping

from core.estimators.base import Estimator
from core.estimators.colmap import lo_ransac
from core.estimators.ransac import ransac

ESTIMATORS: Mapping[str, Estimator] = {"ransac": ransac, "pycolmap": lo_ransac}
