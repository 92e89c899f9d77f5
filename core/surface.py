"""An object's surface, as its views measured it: points, which of them are sound, and which way they face.

Letters: N points.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from core.boxes import inliers
from core.encode import EncodedView
from core.views import FloatArray

NEIGHBOURS = 20
"""Points that a plane is laid through for a normal: about a patch of 4 by 5 of the view's own."""


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
        """Unit vectors, towards the camera that saw each point: a surface is seen from outside only. Shape (N, 3)."""
        points = self.points_m.astype(np.float64)
        eyes = [view.camera.world_from_camera[:3, 3] for view in self.views if view.camera is not None]
        towards = np.repeat(np.stack(eyes), [len(view.points_m) for view in self.views], axis=0) - points
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
        cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(NEIGHBOURS))
        normals = np.asarray(cloud.normals)
        return np.where((normals * towards).sum(axis=1, keepdims=True) < 0, -normals, normals)

    @cached_property
    def _inliers(self) -> NDArray[np.intp]:
        return inliers(self.points_m)

    def draw(self, count: int, seed: int) -> NDArray[np.intp]:
        """Indices of random points, shape (up to count,), none of them an outlier."""
        return np.random.default_rng(seed).permutation(self._inliers)[:count]
