"""Poses in the BOP benchmark's results format: a line an image, scene_id,im_id,obj_id,score,R,t,time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from clients.answers.observations import Pose
from core.views import Camera

HEADER = "scene_id,im_id,obj_id,score,R,t,time"


def bop_lines(pose: Pose, cameras: Sequence[Camera], images: Sequence[Path], scene: int, obj: int, seconds: float) -> list[str]:
    """One line for each image of a burst, without the header.

    The model frame is the object's: the centre and the axes of its category's box. R is row by row, t in millimetres.

    Args:
        cameras, images: of each view; an image's number is its file's, or its place where the name is none.
        seconds: that the whole burst took.
    """
    score = next((value for value in (pose.confidence, pose.score) if value is not None), 0.0)
    lines = []
    for place, (camera, image) in enumerate(zip(cameras, images, strict=True)):
        camera_from_object = camera.camera_from_world @ pose.world_from_object
        rotation = " ".join(f"{value:.9g}" for value in np.ravel(camera_from_object[:3, :3]))
        translation = " ".join(f"{1000 * value:.9g}" for value in camera_from_object[:3, 3])
        number = number_of(image.stem, place)
        lines.append(f"{scene},{number},{obj},{score:.9g},{rotation},{translation},{seconds:.6g}")
    return lines


def number_of(name: str | None, otherwise: int) -> int:
    """The number that a scene, an image or a category is called by, such as 000007."""
    return int(name) if name is not None and name.isascii() and name.isdecimal() else otherwise
