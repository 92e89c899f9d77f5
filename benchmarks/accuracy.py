"""Figures over many pose errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clients.pose_error import PoseError

NO_POSE = PoseError(180.0, np.inf, np.inf)
"""What a refused pose counts as: the worst there is."""


def accuracy(errors: Sequence[PoseError], threshold_deg: float) -> float:
    """Percentage of `errors` whose rotation is at most `threshold_deg` off."""
    return 100 * float(np.mean([error.rotation_deg <= threshold_deg for error in errors]))


def median(errors: Sequence[PoseError], field: str) -> float:
    """Median of one field of PoseError; infinite where at least half of the poses were refused."""
    return float(np.median([getattr(error, field) for error in errors]))
