"""Which recorded viewpoints to take: what the cameras look at, and a few of them spread around it.

Letters: V cameras.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.views import Camera, FloatArray


def aim_point(cameras: Sequence[Camera]) -> FloatArray:
    """The world point nearest to all optical axes (least squares), shape (3,), metres; needs no knowledge of the object."""
    poses = np.stack([camera.world_from_camera for camera in cameras])
    across = np.eye(3) - np.einsum("vi,vj->vij", poses[:, :3, 2], poses[:, :3, 2])
    point, *_ = np.linalg.lstsq(across.sum(axis=0), np.einsum("vij,vj->i", across, poses[:, :3, 3]), rcond=None)
    return np.asarray(point)


def spread(cameras: Sequence[Camera], count: int, first: int = 0) -> list[int]:
    """Indices of `count` cameras, `first` among them, that see the point they aim at from directions far apart, in recorded order.

    Greedy farthest-point choice over the viewing directions; all V where there are no more than `count`.
    """
    towards = np.stack([camera.world_from_camera[:3, 3] for camera in cameras]) - aim_point(cameras)
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    chosen = [first]
    while len(chosen) < min(count, len(cameras)):
        nearest = (towards @ towards[chosen].T).max(axis=1)
        nearest[chosen] = np.inf
        chosen.append(int(nearest.argmin()))
    return sorted(chosen)
