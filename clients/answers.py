"""What the service answers, as numpy and plain types.

Letters: n requested viewpoints, C categories, S symmetries.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Generic, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

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
        )


@dataclass(frozen=True)
class CategorySimilarity:
    """How similar a burst is to one category; larger is more similar."""

    category_id: str
    name: str | None
    similarity: float

    @staticmethod
    def from_json(fields: Mapping[str, Any]) -> CategorySimilarity:
        """From the service's answer."""
        return CategorySimilarity(fields["category_id"], fields["name"], fields["similarity"])


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
    extent_m: float
    """The object's diameter as far as it was seen."""
    covered: NDArray[np.bool_]
    """Of each viewpoint whether a view was taken near it, shape (n,)."""
    views: int
    """Views received so far; of a completed scan 0."""
    faults: tuple[tuple[str, ...], ...]
    """Of each of them what is wrong with it, in words."""
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
            fields["extent_m"],
            np.array(fields["covered"], dtype=bool),
            fields["views"],
            tuple(tuple(fault["detail"] for fault in view["faults"]) for view in fields["received"]),
            fields["views_required"],
        )


class Viewpoints:
    """The viewpoints of a scan, to iterate over."""

    def __init__(self, request: ScanRequest) -> None:
        self.request = request

    @property
    def id(self) -> str:
        """Names it in /v1/scans/{id}."""
        return self.request.id

    def __iter__(self) -> Iterator[FloatArray]:
        """The requested camera poses, each `world_from_camera` of shape (4, 4)."""
        return iter(self.request.world_from_camera)

    def __len__(self) -> int:
        return len(self.request.world_from_camera)


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
    threshold: float | None
    """None where the score, or the rate, decides."""
    false_known_rate: float
    variant: str
    categories: int
    memory_version: int

    @staticmethod
    def from_json(fields: Mapping[str, Any]) -> Info:
        """From the service's answer."""
        return Info(**{name: fields[name] for name in Info.__dataclass_fields__})


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
