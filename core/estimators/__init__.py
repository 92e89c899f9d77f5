"""Robust estimators by name. To add one, add a file here that offers an `Estimator` (`core.estimators.base` says what that is)."""

from __future__ import annotations

from core.estimators.base import Estimator
from core.offers import Offers

ESTIMATORS: Offers[Estimator] = Offers(__name__)
