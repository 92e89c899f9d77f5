"""The object's cloud and its oriented box (paper, appendix, "Bounding boxes for visualising pose estimates").

Letters: N points, V views.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from core.affine9 import Affine9
from core.errors import NoObject
from core.foreground import fit_plane
from core.sim3 import Sim3, homogeneous
from core.views import Camera, FloatArray

BOX_EDGES = tuple((a, a | 1 << axis) for a in range(8) for axis in range(3) if not a & 1 << axis)
"""Pairs of corner indices that make the twelve edges."""
MIN_POINTS = 8
"""Of a cloud that a support or a box is looked for in."""
EXTENT_PERCENTILE = 98
"""Of the distances to the middle: the farthest points are often stray."""
NEIGHBOURS = 10
"""Of a point, the nearest ones, by whose mean distance an outlier is told."""
OUTLIER_DEVIATIONS = 2.0
"""A point whose mean distance to its neighbours is this many standard deviations above the cloud's mean is an outlier.
The appendix uses a fixed distance (5e-5 m), which depends on resolution; this does not."""
SUPPORT_THICKNESS = 0.015
"""Distance to the plane, as a share of the cloud's extent, up to which points are of it."""
SUPPORT_MAX_SHARE = 0.75
"""A plane with a larger share of the points is the object itself: a picture, a screen."""
SUPPORT_ONE_SIDE = 0.95
"""Share of the other points that must stand on the cameras' side of a support."""
SUPPORT_SPREAD = 1.5
"""How much wider than what stands on it a support must be; the face of a box is as wide as the box."""


@dataclass(frozen=True, eq=False)
class OrientedBox:
    """A box in some world frame; its axes and centre are the object frame."""

    world_from_object: FloatArray
    """Rigid transform, shape (4, 4): the origin is the box's centre, the axes run along its edges."""
    extent_m: FloatArray
    """Edge lengths along the object's axes, shape (3,), metres."""

    def corners(self) -> FloatArray:
        """The eight corners in the world frame, shape (8, 3); corner b has sign bits b of (x, y, z)."""
        signs = np.array([[(b >> axis & 1) - 0.5 for axis in range(3)] for b in range(8)])
        return signs * self.extent_m @ self.world_from_object[:3, :3].T + self.world_from_object[:3, 3]

    def in_object(self, points_m: FloatArray) -> FloatArray:
        """World points, shape (N, 3), in the object frame."""
        return np.asarray((points_m - self.world_from_object[:3, 3]) @ self.world_from_object[:3, :3])

    def holds(self, points_m: FloatArray, times: float = 1.0) -> NDArray[np.bool_]:
        """Which world points, shape (N, 3), are within `times` its size, shape (N,)."""
        return np.asarray((np.abs(self.in_object(points_m)) <= times * self.extent_m / 2).all(axis=1))

    def within_image(self, camera: Camera, size: tuple[int, int]) -> tuple[float, float, float, float] | None:
        """(left, top, right, bottom) of its corners in an image of (height, width), pixels; None where one is behind the camera."""
        pixels, depths = camera.project(self.corners())
        if (depths <= 0).any():
            return None
        height, width = size
        (left, top), (right, bottom) = (np.clip(each, 0, (width - 1, height - 1)) for each in (pixels.min(axis=0), pixels.max(axis=0)))
        return float(left), float(top), float(right), float(bottom)

    def moved_by(self, target_from_reference: Sim3) -> OrientedBox:
        """The box on the target: its frame stays rigid, the scale goes into the extent."""
        rotation = target_from_reference.rotation @ self.world_from_object[:3, :3]
        center = target_from_reference.apply(self.world_from_object[:3, 3])
        return OrientedBox(homogeneous(rotation, center), self.extent_m * target_from_reference.scale)

    def stretched_by(self, target_from_object: Affine9) -> OrientedBox:
        """The box on the target, for a transform of its own frame with a scale for each axis."""
        moved = homogeneous(target_from_object.rotation, target_from_object.translation)
        return OrientedBox(moved, self.extent_m * target_from_object.scales)


def remove_support(points: FloatArray, cameras: FloatArray) -> FloatArray:
    """Points, shape (N, 3), without the plane they stand on, where some of it was taken for the object; else as they are.

    A plane is a support where nearly everything else is on the side of it from which it was seen, and where it is clearly wider than that:
    a table's top fails the first, the face of a box the second. An object whose own base is so wide looks the same.

    Args:
        cameras: centres of the cameras, shape (V, 3).
    """
    if len(points) < MIN_POINTS or np.linalg.matrix_rank(points - points.mean(axis=0)) < 2:
        return points
    eye = cameras.mean(axis=0)
    thickness_m = SUPPORT_THICKNESS * cloud_extent_m(points)
    normal, origin = fit_plane(points - eye, thickness_m)
    height_m = (points - eye - origin) @ normal
    on_plane = np.abs(height_m) < thickness_m
    if on_plane.mean() > SUPPORT_MAX_SHARE or (height_m[~on_plane] > 0).mean() < SUPPORT_ONE_SIDE:
        return points
    if _spread(points[on_plane], normal) < SUPPORT_SPREAD * _spread(points[~on_plane], normal):
        return points
    return points[~on_plane]


def _spread(points: FloatArray, normal: FloatArray) -> float:
    """Area over which points, shape (N, 3), scatter along a plane, but for a factor."""
    along = np.linalg.svd(normal[None])[2][1:]
    return float(np.sqrt(max(np.linalg.det(np.cov(points @ along.T, rowvar=False)), 0.0)))


def remove_outliers(points: FloatArray) -> FloatArray:
    """Points, shape (N, 3), without those far from their NEIGHBOURS nearest."""
    return points[inliers(points)]


def inliers(points: FloatArray) -> NDArray[np.intp]:
    """Indices of the points, shape (N, 3), that `remove_outliers` keeps."""
    if len(points) <= NEIGHBOURS:
        return np.arange(len(points))
    _, kept = _cloud(points).remove_statistical_outlier(nb_neighbors=NEIGHBOURS, std_ratio=OUTLIER_DEVIATIONS)
    return np.asarray(kept, dtype=np.intp)


def oriented_box(points: FloatArray) -> OrientedBox:
    """The smallest box around the convex hull of points, shape (N, 3); thin for a flat object. Raises NoObject for too few.

    The appendix takes the box along the hull's principal axes as a fast approximation of this one. Of 44 rendered objects this one's axes
    are 2° off the model's own in the median, those of the approximation 11°, and its volume is 1.3 times as large.
    """
    if len(points) < MIN_POINTS:
        raise NoObject(
            "views",
            f"only {len(points)} object points have measured depth; at least {MIN_POINTS} are needed: check the depth images",
        )
    cloud = _cloud(points)
    try:
        with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):  # it warns of candidates that it drops itself
            box = cloud.get_minimal_oriented_bounding_box()
    except RuntimeError:  # all in one plane: the hull needs joggled input, of which the smallest box fails
        box = cloud.get_oriented_bounding_box(robust=True)
    axes = np.asarray(box.R)
    if np.linalg.det(axes) < 0:
        axes = axes * np.array([1.0, 1.0, -1.0])
    return OrientedBox(homogeneous(axes, np.asarray(box.center)), np.asarray(box.extent))


def cloud_extent_m(points: FloatArray) -> float:
    """Diameter, metres, of a cloud, shape (N, 3): twice the EXTENT_PERCENTILE of the distance to the median point, so robust to stray
    points; 0 of an empty one."""
    if not len(points):
        return 0.0
    return float(2 * np.percentile(np.linalg.norm(points - np.median(points, axis=0), axis=1), EXTENT_PERCENTILE))


def _cloud(points: FloatArray) -> o3d.geometry.PointCloud:
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.asarray(points, dtype=np.float64)))
