"""An observation in 3-D: the reference's points where the pose puts them, over the points that were seen.

Letters: N points.
"""

from __future__ import annotations

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
        cloud("seen", encoded.cloud_m[pose.box.holds(encoded.cloud_m, AROUND)], "target"),
    ]
    return scene(clouds, [box("box", pose.box)], [camera(each, size) for each in cameras], up)


def moved(pose: Pose, reference: Reference) -> FloatArray:
    """The reference's points in the burst's world, shape (N, 3)."""
    if pose.target_from_object is None:
        return pose.target_from_reference.apply(reference.cloud_m)
    return pose.target_from_object.apply(reference.box.in_object(reference.cloud_m))
