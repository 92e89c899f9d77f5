"""An observation in 3-D: the reference's points where the pose puts them, over the points that were seen.

Letters: N points.
"""

from __future__ import annotations

import numpy as np

from core.boxes import OrientedBox
from core.encode import EncodedBurst
from core.reference import Reference
from core.scan import infer_up
from core.views import FloatArray
from service.console.scenes import Part, box, camera, cloud, scene
from store.records import Pose

AROUND = 1.5
"""Points up to this multiple of the box are shown; what is farther was not taken for the object, or by mistake."""


def aligned_scene(pose: Pose, reference: Reference, encoded: EncodedBurst, size: tuple[int, int]) -> Part:
    """For the viewer; `size` is the (height, width) of the burst's pictures."""
    cameras = [view.camera for view in encoded.views if view.camera is not None]
    up, _ = infer_up(cameras)
    clouds = [
        cloud("reference", moved(pose, reference), "reference"),
        cloud("seen", _near(encoded.cloud_m, pose.box), "target"),
    ]
    return scene(clouds, [box("box", pose.box)], [camera(each, size) for each in cameras], up)


def moved(pose: Pose, reference: Reference) -> FloatArray:
    """The reference's points in the burst's world, shape (N, 3)."""
    if pose.target_from_object is None:
        return pose.target_from_reference.apply(reference.cloud_m)
    frame = reference.box.world_from_object
    return pose.target_from_object.apply((reference.cloud_m - frame[:3, 3]) @ frame[:3, :3])


def _near(points_m: FloatArray, oriented: OrientedBox) -> FloatArray:
    frame = oriented.world_from_object
    in_object = (points_m - frame[:3, 3]) @ frame[:3, :3]
    return points_m[(np.abs(in_object) <= AROUND * oriented.extent_m / 2).all(axis=1)]
