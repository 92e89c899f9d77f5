"""Which way a surface faces: a patch is seen from outside only.

Letters: N points.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import open3d as o3d

from core.encode import EncodedView
from core.views import FloatArray

NEIGHBOURS = 20
"""Points that a plane is laid through: about a patch of 4 by 5 of the view's own."""


def outward_normals(views: Sequence[EncodedView]) -> FloatArray:
    """Unit normals at all points of views with trusted patches only, towards the camera that saw each, shape (N, 3)."""
    points = np.concatenate([view.points_m for view in views]).astype(np.float64)
    eyes = [view.camera.world_from_camera[:3, 3] for view in views if view.camera is not None]
    towards = np.repeat(np.stack(eyes), [len(view.points_m) for view in views], axis=0) - points
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(NEIGHBOURS))
    normals = np.asarray(cloud.normals)
    return np.where((normals * towards).sum(axis=1, keepdims=True) < 0, -normals, normals)
