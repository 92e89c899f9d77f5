"""What the service answers, as numpy and plain types.

Letters: n requested viewpoints, C categories.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from core.sim3 import Sim3
from core.views import FloatArray

Outcome = Literal["known", "uncertain", "novel"]


@dataclass(frozen=True, eq=False)
class Pose:
    """Where a known object is and how it is turned, measured from its category's reference."""

    target_from_reference: Sim3
    """From the world frame of the reference scan to the world frame of the burst, metres both."""
    object_in_world: FloatArray
    """Rigid `world_from_object`, shape (4, 4): the object's box, its centre and axes, in the burst's world frame, metres."""
    extent_m: FloatArray
    """Edge lengths of the box along the object's axes, shape (3,), metres."""
    corners_m: FloatArray
    """Its corners in the burst's world frame, shape (8, 3), metres."""
    inliers: int
    correspondences: int
    best_view: int
    """The burst's view in which most correspondences agree; its pictures tell most."""
    residual_m: float
    score: float | None
    confidence: float | None

    @property
    def matrix(self) -> FloatArray:
        """[[λR, t], [0, 1]] of target_from_reference, shape (4, 4)."""
        return self.target_from_reference.as_matrix()

    @property
    def scale(self) -> float:
        """λ: the object's size over the reference's."""
        return self.target_from_reference.scale

    @property
    def rotation(self) -> FloatArray:
        """R, shape (3, 3)."""
        return self.target_from_reference.rotation

    @property
    def translation(self) -> FloatArray:
        """t, shape (3,), metres."""
        return self.target_from_reference.translation

    @staticmethod
    def from_json(fields: Mapping[str, Any]) -> Pose:
        """From the service's answer."""
        return Pose(
            Sim3.from_matrix(np.array(fields["target_from_reference"]["matrix"])),
            np.array(fields["world_from_object"]),
            np.array(fields["box"]["extent_m"]),
            np.array(fields["box"]["corners_m"]),
            fields["inliers"],
            fields["correspondences"],
            fields["best_view"],
            fields["residual_m"],
            fields["score"],
            fields["confidence"],
        )


@dataclass(frozen=True)
class CategorySimilarity:
    """How similar a burst is to one category; larger is more similar."""

    category_id: str
    name: str | None
    similarity: float


@dataclass(frozen=True, eq=False)
class ScanRequest:
    """The views to take of a novel object, in the world frame of its burst."""

    id: str
    center_m: FloatArray
    """Centre of the object, shape (3,), metres."""
    up: FloatArray
    """Unit vector the hemisphere of viewpoints opens along, shape (3,)."""
    radius_m: float
    world_from_camera: FloatArray
    """Camera poses, shape (n, 4, 4), metres, OpenCV axes; near ones will do."""
    views_required: int
    """Fewest views that make a category."""

    @staticmethod
    def from_json(fields: Mapping[str, Any]) -> ScanRequest:
        """From the service's answer."""
        return ScanRequest(
            fields["id"],
            np.array(fields["center_m"]),
            np.array(fields["up"]),
            fields["radius_m"],
            np.array(fields["world_from_camera"]),
            fields["views_required"],
        )


@dataclass(frozen=True)
class Category:
    """A category of objects, learnt from one."""

    id: str
    name: str | None
    created_at: str
    """ISO 8601, UTC."""
    views: int
    """Views of the reference object."""
    instances: int
    """Bursts assigned to it, the reference's own included."""
    extent_m: tuple[float, ...]
    """Edge lengths of the reference's box, metres."""

    @staticmethod
    def from_json(fields: Mapping[str, Any]) -> Category:
        """From the service's answer."""
        extent_m = tuple(fields["extent_m"])
        return Category(fields["id"], fields["name"], fields["created_at"], fields["views"], fields["instances"], extent_m)


@dataclass(frozen=True)
class Info:
    """What the service says of itself and its memory."""

    version: str
    backbone: str
    fingerprint: str
    score: str
    threshold: float
    variant: str
    categories: int
    memory_version: int

    @staticmethod
    def from_json(fields: Mapping[str, Any]) -> Info:
        """From the service's answer."""
        return Info(**{name: fields[name] for name in Info.__dataclass_fields__})


def similarities_from_json(fields: Mapping[str, Any]) -> tuple[CategorySimilarity, ...]:
    """All C categories compared with, most similar first."""
    return tuple(CategorySimilarity(each["category_id"], each["name"], each["similarity"]) for each in fields["similarities"])
