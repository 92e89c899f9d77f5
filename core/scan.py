"""Where to look from: a hemisphere of viewpoints around an object just seen (paper, "Robotic novel object pose rearrangement").

Letters: V views, n viewpoints.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from core.encode import EncodedBurst
from core.errors import InvalidInput, NoObject
from core.views import Camera

FloatArray = NDArray[np.floating]
DEFAULT_VIEWPOINTS = 10
"""The paper scans with 10 or 20."""
ELEVATION_RANGE_DEG = (15.0, 70.0)
GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))
ASSUMED_ELEVATION = np.pi / 4
"""Of a camera whose elevation cannot be told, since all views look from one direction."""


@dataclass(frozen=True, eq=False)
class ScanRequest:
    """Viewpoints that show an object from all sides above its support."""

    center_m: FloatArray
    """The object's middle in the world frame, shape (3,)."""
    up: FloatArray
    """Unit vector, shape (3,)."""
    radius_m: float
    """Distance of every viewpoint from the middle."""
    world_from_camera: FloatArray
    """Shape (n, 4, 4), OpenCV camera axes, each camera aimed at the middle."""


def request_scan(encoded: EncodedBurst, count: int = DEFAULT_VIEWPOINTS) -> ScanRequest:
    """Viewpoints about the object of a burst, at the distance it was seen from.

    Raises InvalidInput for views without cameras, NoObject where no depth places the object.
    """
    cameras = [view.camera for view in encoded.views if view.camera is not None]
    if not cameras:
        raise InvalidInput("views", "none has K and world_from_camera, so viewpoints cannot be placed")
    if not len(encoded.cloud_m):
        raise NoObject("views", "no depth was measured on the object, so viewpoints cannot be placed around it")
    center = np.median(encoded.cloud_m, axis=0).astype(float)
    radius = float(np.median([np.linalg.norm(camera.world_from_camera[:3, 3] - center) for camera in cameras]))
    up = infer_up(cameras)
    return ScanRequest(center, up, radius, hemisphere(center, up, radius, count))


def infer_up(cameras: list[Camera]) -> FloatArray:
    """The direction that every camera's x axis is level with, shape (3,): cameras are held with little roll.

    Where all views look from about one direction this is undetermined, and the first camera is taken to look down at 45°.
    """
    poses = np.stack([camera.world_from_camera for camera in cameras])
    sideways = poses[:, :3, 0]
    spread, vectors = np.linalg.eigh(sideways.T @ sideways / len(poses))
    image_up = -poses[:, :3, 1].mean(axis=0)
    if spread[1] < np.sin(np.radians(15)) ** 2 / 2:
        up = np.cos(ASSUMED_ELEVATION) * -poses[0, :3, 1] - np.sin(ASSUMED_ELEVATION) * poses[0, :3, 2]
    else:
        up = vectors[:, 0] * (np.sign(vectors[:, 0] @ image_up) or 1.0)
    return np.asarray(up / np.linalg.norm(up))


def hemisphere(center_m: FloatArray, up: FloatArray, radius_m: float, count: int) -> FloatArray:
    """Evenly spread camera poses, shape (count, 4, 4), spiralling up between the elevations of ELEVATION_RANGE_DEG."""
    low, high = np.sin(np.radians(ELEVATION_RANGE_DEG))
    heights = low + (high - low) * (np.arange(count) + 0.5) / count
    level = np.cross(up, np.eye(3)[np.abs(up).argmin()])
    level /= np.linalg.norm(level)
    across = np.cross(up, level)
    azimuth = GOLDEN_ANGLE * np.arange(count)
    circle = np.sqrt(1 - heights**2)[:, None] * (np.cos(azimuth)[:, None] * level + np.sin(azimuth)[:, None] * across)
    positions = center_m + radius_m * (circle + heights[:, None] * up)
    return np.stack([look_at(position, center_m, up) for position in positions])


def look_at(position_m: FloatArray, aim_m: FloatArray, up: FloatArray) -> FloatArray:
    """world_from_camera, shape (4, 4), of a camera without roll. Raises InvalidInput where it looks along `up`."""
    forward = aim_m - position_m
    right = np.cross(forward, up)
    if np.linalg.norm(right) < 1e-9 * max(float(np.linalg.norm(forward)), 1e-9):
        raise InvalidInput("position", "is straight above or at the aim, so the camera's roll is not determined")
    z = forward / np.linalg.norm(forward)
    x = right / np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    pose[:3, 3] = position_m
    return pose


def nearest_view(world_from_camera: FloatArray, candidates: FloatArray, center_m: FloatArray) -> tuple[int, float]:
    """Which of the candidate poses, shape (n, 4, 4), sees the object most nearly from the side of a pose, and the angle off in degrees."""
    wanted = world_from_camera[:3, 3] - center_m
    offered = candidates[:, :3, 3] - center_m
    cosines = offered @ wanted / (np.linalg.norm(offered, axis=1) * np.linalg.norm(wanted)).clip(1e-12)
    best = int(cosines.argmax())
    return best, float(np.degrees(np.arccos(np.clip(cosines[best], -1, 1))))
