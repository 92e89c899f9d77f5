"""The rigid motion that takes an object to where another of its category once stood (paper, "Robotic novel object pose rearrangement").

Letters: S symmetries.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from core.boxes import OrientedBox
from core.errors import InvalidInput
from core.sim3 import Sim3, homogeneous, rotation_angle_deg
from core.views import FloatArray

Anchor = Literal["center", "base"]
"""The point that the motion takes exactly to its goal: the middle of the object, or of the face that it stands on.
Objects of one category differ in size, so only one point can; `base` puts a smaller one on the same support."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A rigid motion within one world frame."""

    goal_from_current: FloatArray
    """Shape (4, 4), metres: where a point of the object is now to where it shall be."""
    angle_deg: float
    """Of its rotation."""
    distance_m: float
    """That the anchor moves."""
    symmetric: bool
    """Whether the object ends turned by one of its symmetries, since that is less to turn."""


def rearrange(
    box: OrientedBox,
    symmetries: FloatArray,
    goal_from_reference: Sim3,
    current_from_reference: Sim3,
    *,
    anchor: Anchor = "center",
    up: FloatArray | None = None,
) -> Motion:
    """The motion of an object seen at `current_from_reference` to the goal pose.

    Args:
        box: the reference's, in the world frame of its scan.
        symmetries: rotations about the box's centre that map the reference onto itself, shape (S, 3, 3).
        goal_from_reference, current_from_reference: into one world frame.
        up: away from the support at the goal, unit vector, shape (3,), for the anchor `base`.

    Raises InvalidInput where `base` has no `up`.
    """
    turns = np.concatenate([np.eye(3)[None], np.asarray(symmetries, dtype=float).reshape(-1, 3, 3)])
    rotations = goal_from_reference.rotation @ turns @ current_from_reference.rotation.T
    chosen = int(np.argmin(np.round(rotation_angle_deg(rotations, np.eye(3)), 6)))  # rounded: equal turns keep the identity
    rotation = rotations[chosen]
    goal, current = box.moved_by(goal_from_reference), box.moved_by(current_from_reference)
    start, end = current.world_from_object[:3, 3], goal.world_from_object[:3, 3]
    if anchor == "base":
        if up is None:
            raise InvalidInput("up", "is missing: the base of an object is its lowest side, so say where up is at the goal")
        turned = current.moved_by(Sim3.turn_about(start, rotation))
        end = end - _half_height(goal, up) * up
        start = start - _half_height(turned, up) * (rotation.T @ up)
    angle = float(rotation_angle_deg(rotation, np.eye(3)))
    return Motion(homogeneous(rotation, end - rotation @ start), angle, float(np.linalg.norm(end - start)), chosen != 0)


def _half_height(box: OrientedBox, up: FloatArray) -> float:
    """From a box's middle to its lowest point, along a unit vector."""
    return float(np.abs(box.world_from_object[:3, :3].T @ up) @ box.extent_m / 2)
