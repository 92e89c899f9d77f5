"""Where to look from: a hemisphere of viewpoints around an object just seen (paper, "Robotic novel object pose rearrangement").

Letters: n viewpoints, e excluded ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from core.boxes import cloud_extent_m, remove_outliers
from core.camera_poses import angles_about_deg, hemisphere, nearest_view
from core.encode import EncodedBurst
from core.errors import InvalidInput, NoObject
from core.views import Camera, FloatArray

UpSource = Literal["given", "cameras", "assumed"]
DEFAULT_VIEWPOINTS = 10
"""The paper scans with 10 or 20."""
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
LEAST_TURN_DEG = 15.0
"""Cameras whose x axes lie nearer to one direction than this do not tell which way is up."""


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
    """Viewpoints that the robot cannot reach, shape (e, 4, 4); what replaces them is near none of them."""


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
    if spread[1] < np.sin(np.radians(LEAST_TURN_DEG)) ** 2 / 2:
        up = np.cos(ASSUMED_ELEVATION) * -poses[0, :3, 1] - np.sin(ASSUMED_ELEVATION) * poses[0, :3, 2]
        return np.asarray(up / np.linalg.norm(up)), "assumed"
    up = vectors[:, 0] * (np.sign(vectors[:, 0] @ image_up) or 1.0)
    return np.asarray(up / np.linalg.norm(up)), "cameras"


def exclude(request: ScanRequest, unreachable: Sequence[int]) -> ScanRequest:
    """The request without some of its viewpoints: each is replaced, in its place, by the direction farthest from all others.

    A replacement is never within REACH_DEG of what was excluded, nor within half of it of another viewpoint; where no such direction is
    left the list becomes shorter.
    Raises InvalidInput for an index that there is not, and where no viewpoint is left.
    """
    count = len(request.world_from_camera)
    wrong = [index for index in unreachable if not 0 <= index < count]
    if wrong:
        raise InvalidInput("viewpoints", f"{wrong[0]} is none of the scan's viewpoints 0 to {count - 1}")
    excluded = np.concatenate([request.excluded, request.world_from_camera[sorted(set(unreachable))]])
    offered = hemisphere(request.center_m, request.up, request.radius_m, CANDIDATES)
    offered = offered[(angles_about_deg(offered[:, :3, 3], excluded[:, :3, 3], request.center_m) > REACH_DEG).all(axis=1)]
    poses: list[FloatArray | None] = [None if index in unreachable else pose for index, pose in enumerate(request.world_from_camera)]
    for index in sorted(set(unreachable)):
        kept = [pose[:3, 3] for pose in poses if pose is not None]
        apart = angles_about_deg(offered[:, :3, 3], np.stack(kept), request.center_m) if kept else np.full((len(offered), 1), 180.0)
        nearest = apart.min(axis=1)
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
    taken = np.array([pose[:3, 3] for pose in world_from_camera]).reshape(-1, 3)
    covered = np.any(angles_about_deg(request.world_from_camera[:, :3, 3], taken, request.center_m) <= REACH_DEG, axis=1)
    return Coverage(viewpoints, tuple(angle for _, angle in near), tuple(map(bool, covered)))


def unit_up(up: Sequence[float]) -> FloatArray:
    """A direction away from the support as a unit vector, shape (3,). Raises InvalidInput where it has none."""
    length = float(np.linalg.norm(up))
    if not np.isfinite(length) or length < 1e-9:
        raise InvalidInput("up", f"expected a direction away from the support, found {list(up)}")
    return np.asarray(up, dtype=float) / length
