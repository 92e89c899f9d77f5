"""Camera poses about a point: spread over a hemisphere, drawn at random, in the order of a short way, and how far apart they are.

Poses are world_from_camera, OpenCV camera axes. Letters: n, m cameras.
"""

from __future__ import annotations

import numpy as np

from core.errors import InvalidInput
from core.sim3 import homogeneous
from core.views import FloatArray

ELEVATION_RANGE_DEG = (15.0, 70.0)
"""Of the ways from the centre to viewpoints, above the plane across `up`."""
GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))
"""Radians from one azimuth to the next, which leave no direction empty however many there are."""


def hemisphere(center_m: FloatArray, up: FloatArray, radius_m: float, count: int) -> FloatArray:
    """Evenly spread camera poses, shape (count, 4, 4), spiralling up between the elevations of ELEVATION_RANGE_DEG.

    They look at `center_m`, shape (3,); `up` is a unit vector, shape (3,).
    """
    low, high = np.sin(np.radians(ELEVATION_RANGE_DEG))
    heights = low + (high - low) * (np.arange(count) + 0.5) / count
    return _around(center_m, up, radius_m, heights, GOLDEN_ANGLE * np.arange(count))


def waypoints(
    center_m: FloatArray, up: FloatArray, radius_m: float, count: int, seed: int, world_from_camera: FloatArray | None = None
) -> FloatArray:
    """Random camera poses that look at a known object, shape (count, 4, 4), in the order of a short way past them all.

    They are spread evenly by chance over the part of the hemisphere between the elevations of ELEVATION_RANGE_DEG (paper, "Robotic novel
    object pose rearrangement": random waypoints from which pose estimates are inspected).

    Args:
        center_m: what they look at, in the world frame, shape (3,).
        up: away from the support, unit vector, shape (3,).
        radius_m: distance of each from the centre.
        count: at least 1.
        seed: of where they are; which are drawn does not depend on where the camera is.
        world_from_camera: the camera's present pose, shape (4, 4), from which the way starts; from the first one drawn where left out.
    """
    chance = np.random.default_rng(seed)
    low, high = np.sin(np.radians(ELEVATION_RANGE_DEG))
    poses = _around(center_m, up, radius_m, chance.uniform(low, high, count), chance.uniform(0, 2 * np.pi, count))
    start = poses[0] if world_from_camera is None else world_from_camera
    return poses[short_tour(poses[:, :3, 3], start[:3, 3])]


def short_tour(positions_m: FloatArray, start_m: FloatArray) -> list[int]:
    """An order of positions, shape (n, 3), for a way from `start_m`, shape (3,): each is followed by the nearest of those left."""
    here, left, order = start_m, list(range(len(positions_m))), []
    while left:
        order.append(left.pop(int(np.linalg.norm(positions_m[left] - here, axis=1).argmin())))
        here = positions_m[order[-1]]
    return order


def _around(center_m: FloatArray, up: FloatArray, radius_m: float, heights: FloatArray, azimuth: FloatArray) -> FloatArray:
    """Poses that look at the centre, shape (n, 4, 4), from the sines of their elevations and their azimuths in radians, shape (n,) each."""
    level = np.cross(up, np.eye(3)[np.abs(up).argmin()])
    level /= np.linalg.norm(level)
    across = np.cross(up, level)
    circle = np.sqrt(1 - heights**2)[:, None] * (np.cos(azimuth)[:, None] * level + np.sin(azimuth)[:, None] * across)
    positions = center_m + radius_m * (circle + heights[:, None] * up)
    return np.stack([look_at(position, center_m, up) for position in positions])


def look_at(position_m: FloatArray, aim_m: FloatArray, up: FloatArray) -> FloatArray:
    """world_from_camera, shape (4, 4), of a camera without roll, from shapes (3,) each. Raises InvalidInput where it looks along `up`."""
    forward = aim_m - position_m
    right = np.cross(forward, up)
    if np.linalg.norm(right) < 1e-9 * max(float(np.linalg.norm(forward)), 1e-9):
        raise InvalidInput("position", "is straight above or at the aim, so the camera's roll is not determined")
    z = forward / np.linalg.norm(forward)
    x = right / np.linalg.norm(right)
    return homogeneous(np.stack([x, np.cross(z, x), z], axis=1), position_m)


def nearest_view(world_from_camera: FloatArray, candidates: FloatArray, center_m: FloatArray) -> tuple[int, float]:
    """Which of the candidate poses, shape (n, 4, 4), sees the object most nearly from the side of a pose, shape (4, 4), and degrees off."""
    angles = angles_about_deg(world_from_camera[None, :3, 3], candidates[:, :3, 3], center_m)[0]
    best = int(angles.argmin())
    return best, float(angles[best])


def angles_about_deg(first_m: FloatArray, second_m: FloatArray, center_m: FloatArray) -> FloatArray:
    """Angles about a point, shape (n, m), between cameras at these places, shapes (n, 3) and (m, 3)."""
    left, right = first_m - center_m, second_m - center_m
    left, right = (each / np.linalg.norm(each, axis=1, keepdims=True).clip(1e-12) for each in (left, right))
    return np.asarray(np.degrees(np.arccos(np.clip(left @ right.T, -1, 1))))
