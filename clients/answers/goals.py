"""Goals and plans."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from clients.answers.observations import sim3_from_json
from core.sim3 import Sim3
from core.views import FloatArray

Anchor = Literal["center", "base"]
"""Which point of an object goes exactly to its goal: its centre, or the middle of its base."""


@dataclass(frozen=True, eq=False)
class Goal:
    """Where objects of a category shall end."""

    id: str
    category_id: str
    name: str | None
    anchor: Anchor
    frame: str | None
    """Name of the world frame that it is in."""
    target_from_reference: Sim3
    """From the world frame of the reference scan to the goal's, metres both."""

    @staticmethod
    def from_json(fields: Mapping[str, Any]) -> Goal:
        """From the service's answer."""
        transform = sim3_from_json(fields["target_from_reference"])
        return Goal(fields["id"], fields["category_id"], fields["name"], fields["anchor"], fields["frame"], transform)


@dataclass(frozen=True, eq=False)
class Plan:
    """How an object gets to its goal."""

    goal: Goal
    observation_id: str
    """Of the object as it is now."""
    goal_from_current: FloatArray
    """The rigid motion within the world frame, shape (4, 4), metres: a gripper that holds the object goes from world_from_gripper to
    goal_from_current · world_from_gripper."""
    angle_deg: float
    """That the object turns."""
    distance_m: float
    """That the anchor moves."""
    symmetric: bool
    """Whether it ends turned by one of its symmetries."""
    world_from_object: FloatArray
    """Rigid, shape (4, 4), metres: the object's box once it is there."""

    @staticmethod
    def from_json(fields: Mapping[str, Any]) -> Plan:
        """From the service's answer."""
        return Plan(
            Goal.from_json(fields["goal"]),
            fields["observation_id"],
            np.array(fields["goal_from_current"]["matrix"]),
            fields["angle_deg"],
            fields["distance_m"],
            fields["symmetric"],
            np.array(fields["world_from_object"]),
        )
