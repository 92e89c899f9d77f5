"""Observations, and the pose of what was seen.

Letters: n viewpoints, S symmetries.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Generic, Literal, TypeVar

import numpy as np

from clients.answers.categories import CategorySimilarity
from clients.answers.scans import ScanRequest
from core.affine9 import Affine9
from core.sim3 import Sim3
from core.views import FloatArray

Outcome = Literal["known", "uncertain", "novel"]
S = TypeVar("S")
R = TypeVar("R")


@dataclass(frozen=True, eq=False)
class Alternative:
    """Another transform that was considered."""

    target_from_reference: Sim3
    score: float
    """To be compared with the pose's."""
    confidence: float | None

    @staticmethod
    def from_json(fields: Mapping[str, Any]) -> Alternative:
        """From the service's answer."""
        return Alternative(sim3_from_json(fields["target_from_reference"]), fields["score"], fields["confidence"])


@dataclass(frozen=True, eq=False)
class Pose:
    """Where a known object is and how it is turned, measured from its category's reference."""

    target_from_reference: Sim3
    """From the world frame of the reference scan to the world frame of the burst, metres both."""
    world_from_object: FloatArray
    """Rigid, shape (4, 4): the object's box, its centre and axes, in the burst's world frame, metres."""
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
    """How well both objects agree, in [0, 1], where the variant computes it."""
    confidence: float | None
    """Probability that the rotation is within 30°, where the variant estimates one."""
    alternatives: tuple[Alternative, ...]
    """Other transforms that were considered, best first."""
    symmetries: FloatArray
    """Rotations about the object frame's origin, in that frame, after which the pose means the same: (w, x, y, z), shape (S, 4)."""
    boxes_px: tuple[FloatArray | None, ...] = ()
    """Of each view of the burst (left, top, right, bottom) around the box's corners, pixels; None where a corner is behind the camera."""
    target_from_object: Affine9 | None = None
    """With dof=9: from the reference's object frame to the world frame of the burst, a scale for each axis."""
    not_9d_because: str | None = None
    """Why there is none though it was asked for."""

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
            sim3_from_json(fields["target_from_reference"]),
            np.array(fields["world_from_object"]),
            np.array(fields["box"]["extent_m"]),
            np.array(fields["box"]["corners_m"]),
            fields["inliers"],
            fields["correspondences"],
            fields["best_view"],
            fields["residual_m"],
            fields["score"],
            fields["confidence"],
            tuple(Alternative.from_json(each) for each in fields["alternatives"]),
            np.array(fields["symmetries"], dtype=float).reshape(-1, 4),
            tuple(None if box is None else np.array(box, dtype=float) for box in fields["boxes_px"]),
            _affine9(fields["target_from_object"]) if fields["target_from_object"] else None,
            fields["not_9d_because"],
        )


@dataclass(frozen=True, eq=False)
class Observation(Generic[S]):
    """What the service says of one burst; S is a scan's type."""

    id: str
    outcome: Outcome
    category_id: str | None
    name: str | None
    """The category's name, where people gave it one."""
    pose: Pose | None
    """Of a known object."""
    pose_error: str | None
    """Why a known object has no pose."""
    scan: S | None
    """Of a novel object: to be carried out so that it becomes a category."""
    scan_error: str | None
    similarities: tuple[CategorySimilarity, ...]
    """Categories, most similar first."""
    threshold: float | None
    """Least similarity of a known object; None where the request named the category."""
    timings_ms: Mapping[str, float]
    """Milliseconds of each stage in the service, and their `total`."""
    raw: Mapping[str, Any]
    """The answer's JSON."""
    margin: float | None = None
    """By how much the most similar category leads the next."""
    probability: float | None = None
    """Estimated, that the most similar category is right."""
    candidates: tuple[str, ...] = ()
    """Categories that an uncertain object may be of."""
    viewpoints: FloatArray | None = None
    """Of an uncertain object: world_from_camera of where to look next, most telling first, shape (n, 4, 4)."""
    corrected_to: str | None = None
    """The category that somebody said it was of."""

    def with_scan(self, make: Callable[[S], R]) -> Observation[R]:
        """The same, with what `make` makes of its scan, if it has one."""
        return replace(self, scan=None if self.scan is None else make(self.scan))  # type: ignore[arg-type, return-value]

    @staticmethod
    def from_json(fields: Mapping[str, Any]) -> Observation[ScanRequest]:
        """From the service's answer."""
        return Observation(
            id=fields["id"],
            outcome=fields["outcome"],
            category_id=fields["category_id"],
            name=fields["name"],
            pose=Pose.from_json(fields["pose"]) if fields["pose"] else None,
            pose_error=fields["pose_error"],
            scan=ScanRequest.from_json(fields["scan"]) if fields["scan"] else None,
            scan_error=fields["scan_error"],
            similarities=tuple(CategorySimilarity.from_json(each) for each in fields["similarities"]),
            threshold=fields["threshold"],
            margin=fields["margin"],
            probability=fields["probability"],
            candidates=tuple(fields["candidates"]),
            viewpoints=None if fields["viewpoints"] is None else np.array(fields["viewpoints"], dtype=float).reshape(-1, 4, 4),
            timings_ms=fields["timings_ms"],
            corrected_to=fields["corrected_to"],
            raw=fields,
        )


def sim3_from_json(fields: Mapping[str, Any]) -> Sim3:
    """A similarity of an answer."""
    return Sim3.from_matrix(np.array(fields["matrix"]))


def _affine9(fields: Mapping[str, Any]) -> Affine9:
    scales = np.array(fields["scales"])
    matrix = np.array(fields["matrix"])
    return Affine9(scales, matrix[:3, :3] / scales, matrix[:3, 3])
