"""Where to look from: a hemisphere of viewpoints around an object just seen (paper, "Robotic novel object pose rearrangement").

Letters: V views, n viewpoints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from core.boxes import cloud_extent_m, remove_outliers
from core.encode import EncodedBurst
from core.errors import InvalidInput, NoObject
from core.views import Camera

FloatArray = NDArray[np.floating]
UpSource = Literal["given", "cameras", "assumed"]
DEFAULT_VIEWPOINTS = 10
"""The paper scans with 10 or 20."""
ELEVATION_RANGE_DEG = (15.0, 70.0)
GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))
ASSUMED_ELEVATION = np.pi / 4
"""Of a camera whose elevation cannot be told, since all views look from one direction."""
OBJECT_SHARE = 0.5
"""Of the image's shorter side that the object shall fill: close enough for its patches, with room for a centre that is a little off."""
LEAST_STANDOFF_M = 0.2
"""Nearer, the depth cameras that robots carry measure nothing."""
REACH_DEG = 20.0
"""A camera this near a viewpoint, by angle about the object, shows what the viewpoint asked for. Ten viewpoints are about 45° apart."""
CANDIDATES = 400
"""Directions tried for a replacement: about 5° apart."""


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
    extent_m: float
    """Diameter of the object as far as it was seen."""
    up_from: UpSource = "given"
    """Whether `up` was given, told from the cameras' orientations, or assumed since they do not tell it."""
    excluded: FloatArray = field(default_factory=lambda: np.empty((0, 4, 4)))
    """Viewpoints that the robot cannot reach, shape (e, 4, 4); none of the others is near one."""


@dataclass(frozen=True)
class ScanOptions:
    """What a caller may say of a scan."""

    viewpoints: int = DEFAULT_VIEWPOINTS
    up: tuple[float, float, float] | None = None
    """Away from the support, any length; told from the cameras where left out."""
    standoff_m: float | None = None
    """Distance of the viewpoints from the object's middle; such that the object fills OBJECT_SHARE of the image where left out."""


def request_scan(encoded: EncodedBurst, options: ScanOptions | None = None) -> ScanRequest:
    """Viewpoints about the object of a burst.

    Raises InvalidInput for views without cameras or an `up` without direction, NoObject where no depth places the object.
    """
    options = options or ScanOptions()
    cameras = [view.camera for view in encoded.views if view.camera is not None]
    if not cameras:
        raise InvalidInput("views", "none has K and world_from_camera, so viewpoints cannot be placed")
    if not len(encoded.cloud_m):
        raise NoObject("views", "no depth was measured on the object, so viewpoints cannot be placed around it")
    cloud = remove_outliers(encoded.cloud_m)  # a few patches of what is behind would have the viewpoints metres away
    center = np.median(cloud, axis=0).astype(float)
    extent = cloud_extent_m(cloud)
    up, source = infer_up(cameras) if options.up is None else (unit_up(options.up), "given")
    radius = standoff_m(extent, cameras) if options.standoff_m is None else options.standoff_m
    return ScanRequest(center, up, radius, hemisphere(center, up, radius, options.viewpoints), extent, source)


def standoff_m(extent_m: float, cameras: Sequence[Camera]) -> float:
    """Distance from which an object of this diameter fills OBJECT_SHARE of the shorter side of these cameras' images.

    The principal point stands for half the image.
    """
    shares = [OBJECT_SHARE * 2 * min(camera.K[0, 2], camera.K[1, 2]) / min(camera.K[0, 0], camera.K[1, 1]) for camera in cameras]
    return max(float(extent_m / np.median(shares)), LEAST_STANDOFF_M)


def infer_up(cameras: Sequence[Camera]) -> tuple[FloatArray, UpSource]:
    """The direction that every camera's x axis is level with, shape (3,): cameras are held with little roll.

    Where all views look from about one direction this is undetermined, and the first camera is taken to look down at 45°.
    """
    poses = np.stack([camera.world_from_camera for camera in cameras])
    sideways = poses[:, :3, 0]
    spread, vectors = np.linalg.eigh(sideways.T @ sideways / len(poses))
    image_up = -poses[:, :3, 1].mean(axis=0)
    if spread[1] < np.sin(np.radians(15)) ** 2 / 2:
        up = np.cos(ASSUMED_ELEVATION) * -poses[0, :3, 1] - np.sin(ASSUMED_ELEVATION) * poses[0, :3, 2]
        return np.asarray(up / np.linalg.norm(up)), "assumed"
    up = vectors[:, 0] * (np.sign(vectors[:, 0] @ image_up) or 1.0)
    return np.asarray(up / np.linalg.norm(up)), "cameras"


def exclude(request: ScanRequest, unreachable: Sequence[int]) -> ScanRequest:
    """The request without some of its viewpoints: each is replaced, in its place, by the direction farthest from all others.

    A replacement is never within REACH_DEG of what was excluded; where no direction is left the list becomes shorter.
    Raises InvalidInput for an index that there is not, and where no viewpoint is left.
    """
    count = len(request.world_from_camera)
    wrong = [index for index in unreachable if not 0 <= index < count]
    if wrong:
        raise InvalidInput("viewpoints", f"{wrong[0]} is none of the scan's viewpoints 0 to {count - 1}")
    excluded = np.concatenate([request.excluded, request.world_from_camera[sorted(set(unreachable))]])
    offered = hemisphere(request.center_m, request.up, request.radius_m, CANDIDATES)
    offered = offered[(angles_about_deg(offered, excluded, request.center_m) > REACH_DEG).all(axis=1)]
    poses: list[FloatArray | None] = [None if index in unreachable else pose for index, pose in enumerate(request.world_from_camera)]
    for index in sorted(set(unreachable)):
        kept = [pose for pose in poses if pose is not None]
        nearest = angles_about_deg(offered, np.stack(kept), request.center_m).min(axis=1) if kept else np.full(len(offered), 180.0)
        if len(offered) and nearest.max() > REACH_DEG / 2:
            poses[index] = offered[int(nearest.argmax())]
    left = [pose for pose in poses if pose is not None]
    if not left:
        raise InvalidInput("viewpoints", "no viewpoint is left: every direction is near an unreachable one; move the object or the robot")
    return replace(request, world_from_camera=np.stack(left), excluded=excluded)


@dataclass(frozen=True)
class Coverage:
    """Which viewpoints the views that came stand for."""

    viewpoint: tuple[int | None, ...]
    """Of each view the viewpoint it was taken near, None where it is near none."""
    angle_deg: tuple[float, ...]
    """Of each view the angle about the object to the nearest viewpoint."""
    covered: tuple[bool, ...]
    """Of each viewpoint whether a view was taken near it."""


def coverage(request: ScanRequest, world_from_camera: Sequence[FloatArray]) -> Coverage:
    """How far the views taken from these camera poses, each (4, 4), carry out a scan."""
    near = [nearest_view(pose, request.world_from_camera, request.center_m) for pose in world_from_camera]
    viewpoints = tuple(index if angle <= REACH_DEG else None for index, angle in near)
    taken = np.stack(world_from_camera) if len(world_from_camera) else np.empty((0, 4, 4))
    covered = np.any(angles_about_deg(request.world_from_camera, taken, request.center_m) <= REACH_DEG, axis=1)
    return Coverage(viewpoints, tuple(angle for _, angle in near), tuple(map(bool, np.atleast_1d(covered))))


def hemisphere(center_m: FloatArray, up: FloatArray, radius_m: float, count: int) -> FloatArray:
    """Evenly spread camera poses, shape (count, 4, 4), spiralling up between the elevations of ELEVATION_RANGE_DEG."""
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
    angles = angles_about_deg(world_from_camera[None], candidates, center_m)[0]
    best = int(angles.argmin())
    return best, float(angles[best])


def angles_about_deg(first: FloatArray, second: FloatArray, center_m: FloatArray) -> FloatArray:
    """Angles about the object between cameras, shapes (n, 4, 4) and (m, 4, 4), shape (n, m)."""
    left, right = ((poses[:, :3, 3] - center_m) for poses in (first, second))
    left, right = (each / np.linalg.norm(each, axis=1, keepdims=True).clip(1e-12) for each in (left, right))
    return np.asarray(np.degrees(np.arccos(np.clip(left @ right.T, -1, 1))))


def unit_up(up: Sequence[float]) -> FloatArray:
    """A direction away from the support as a unit vector, shape (3,). Raises InvalidInput where it has none."""
    length = float(np.linalg.norm(up))
    if not np.isfinite(length) or length < 1e-9:
        raise InvalidInput("up", f"expected a direction away from the support, found {list(up)}")
    return np.asarray(up, dtype=float) / length
