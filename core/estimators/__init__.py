"""Robust estimators by name. To add one, add a file here that offers an `Estimator` (`core.estimators.base` says what that is).

For those of one's own, `ransac` has random samples with their inliers and the refitting of a winner, `batched` many transforms at once.
"""

from __future__ import annotations

from core.estimators.base import Estimator
from core.offers import Offers

ESTIMATORS: Offers[Estimator] = Offers(__name__)
