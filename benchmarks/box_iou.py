"""Intersection over union of two boxes that a linear map may have sheared.

Letters: N points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.views import FloatArray

SAMPLES = 48
"""Points an edge of the grid that measures the intersection: a side's place is off by at most 1 % of its length."""


@dataclass(frozen=True, eq=False)
class Parallelepiped:
    """The image of the cube [-1/2, 1/2]³ under an affine map."""

    world_from_cube: FloatArray
    """Shape (4, 4)."""

    @staticmethod
    def around(points: FloatArray) -> Parallelepiped:
        """The box along the axes around points, shape (N, 3)."""
        low, high = points.min(axis=0), points.max(axis=0)
        matrix = np.diag([*(high - low), 1.0])
        matrix[:3, 3] = (low + high) / 2
        return Parallelepiped(matrix)

    def carried_by(self, matrix: FloatArray) -> Parallelepiped:
        """The same under a further affine map, shape (4, 4)."""
        return Parallelepiped(matrix @ self.world_from_cube)

    @property
    def volume(self) -> float:
        """Cubic metres."""
        return float(abs(np.linalg.det(self.world_from_cube[:3, :3])))


def box_iou(first: Parallelepiped, second: Parallelepiped) -> float:
    """Volume of the intersection over that of the union, by a grid of points in the first. 0 where one of them is flat."""
    if min(first.volume, second.volume) <= 0:
        return 0.0
    along = (np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5
    points = np.stack(np.meshgrid(along, along, along), axis=-1).reshape(-1, 3)
    cube_from_cube = np.linalg.solve(second.world_from_cube, first.world_from_cube)
    inside = np.abs(points @ cube_from_cube[:3, :3].T + cube_from_cube[:3, 3]).max(axis=1) <= 0.5
    shared = float(inside.mean()) * first.volume
    return shared / (first.volume + second.volume - shared)
