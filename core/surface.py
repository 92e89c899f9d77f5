"""An object's surface, as its views measured it: points, which of them are sound, and which way they face.

Letters: N points.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from core.boxes import inliers
from core.encode import EncodedView
from core.normals import outward_normals
from core.views import FloatArray


class Surface:
    """Of views with trusted patches only; what is costly is found once, when it is asked for."""

    def __init__(self, views: Sequence[EncodedView]) -> None:
        self.views = views

    @cached_property
    def points_m(self) -> FloatArray:
        """In the world frame, shape (N, 3)."""
        return np.concatenate([view.points_m for view in self.views])

    @cached_property
    def normals(self) -> FloatArray:
        """Shape (N, 3), see `outward_normals`."""
        return outward_normals(self.views)

    @cached_property
    def _inliers(self) -> NDArray[np.intp]:
        return inliers(self.points_m)

    def draw(self, count: int, seed: int) -> NDArray[np.intp]:
        """Indices of up to `count` random points without outliers."""
        return np.random.default_rng(seed).permutation(self._inliers)[:count]
