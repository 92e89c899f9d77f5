"""What the memory keeps, as it is handed out: frozen, with ids as plain strings and times as ISO 8601 in UTC.

Letters: V views, D token size, n requested viewpoints.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from core.boxes import OrientedBox
from core.novelty import Decision
from core.scan import ScanRequest
from core.sim3 import Sim3

Outcome = Literal["known", "uncertain", "novel"]
ScanState = Literal["requested", "collecting", "completed"]


@dataclass(frozen=True, eq=False)
class Category:
    """A category: its reference is read apart, being large."""

    id: str
    name: str | None
    created_at: str
    views: int
    """Reference views."""
    instances: int
    """Bursts assigned to it."""
    extent_m: tuple[float, float, float]
    """Edge lengths of the reference's oriented box, metres."""
    reference_sha256: str


@dataclass(frozen=True, eq=False)
class Scan:
    """Views asked for, to learn a category from."""

    id: str
    created_at: str
    state: ScanState
    request: ScanRequest
    views: int
    """Views received so far."""
    observation_id: str | None
    """The observation whose object is scanned."""
    category_id: str | None
    """The category the completed scan made."""


@dataclass(frozen=True, eq=False)
class Pose:
    """Where the object of a burst is, measured from the reference of its category."""

    target_from_reference: Sim3
    box: OrientedBox
    """The reference's box, moved to the target: its frame is `world_from_object`."""
    inliers: int
    correspondences: int
    best_view: int
    """The burst's view in which most correspondences agree."""
    residual_m: float
    score: float | None
    """Agreement of both objects' points, where the variant computes it; of the same kind as the alternatives' scores."""
    confidence: float | None
    alternatives: tuple[tuple[Sim3, float], ...]
    """Other transforms considered, best first, with their scores."""


@dataclass(frozen=True, eq=False)
class Observation:
    """One burst that was looked at, and what was answered."""

    id: str
    created_at: str
    outcome: Outcome
    category_id: str | None
    """The category it was recognised as; None where there is none, or where that category was deleted since."""
    frame: str | None
    """Name of the burst's world frame, as the caller gave it."""
    views: int
    decision: Decision | None
    """None where the caller named the category."""
    pose: Pose | None
    pose_error: str | None
    """Why a known object has no pose."""
    scan_id: str | None
    scan_error: str | None
    """Why a novel object has no scan."""
    timings_ms: dict[str, float]
    features_sha256: str


def request_to_json(request: ScanRequest) -> str:
    """One TEXT column."""
    arrays = {name: getattr(request, name).tolist() for name in ("center_m", "up", "world_from_camera", "excluded")}
    return json.dumps(arrays | {"radius_m": request.radius_m, "extent_m": request.extent_m, "up_from": request.up_from})


def request_from_json(text: str) -> ScanRequest:
    """The inverse of `request_to_json`."""
    fields = json.loads(text)
    return ScanRequest(
        center_m=np.array(fields["center_m"]),
        up=np.array(fields["up"]),
        radius_m=fields["radius_m"],
        world_from_camera=np.array(fields["world_from_camera"]),
        extent_m=fields.get("extent_m", fields["radius_m"] / 2),
        up_from=fields.get("up_from", "cameras"),
        excluded=np.array(fields.get("excluded", ())).reshape(-1, 4, 4),
    )


def decision_to_json(decision: Decision) -> str:
    """One TEXT column."""
    return json.dumps(
        {"outcome": decision.outcome, "score": decision.score, "threshold": decision.threshold, "similarities": decision.similarities}
    )


def decision_from_json(text: str) -> Decision:
    """The inverse of `decision_to_json`."""
    fields = json.loads(text)
    similarities = tuple((category_id, similarity) for category_id, similarity in fields.pop("similarities"))
    return Decision(**fields, similarities=similarities)


def pose_to_json(pose: Pose) -> str:
    """One TEXT column."""
    return json.dumps(
        {
            "target_from_reference": _sim3(pose.target_from_reference),
            "box": {"world_from_object": pose.box.world_from_object.tolist(), "extent_m": pose.box.extent_m.tolist()},
            "inliers": pose.inliers,
            "correspondences": pose.correspondences,
            "best_view": pose.best_view,
            "residual_m": pose.residual_m,
            "score": pose.score,
            "confidence": pose.confidence,
            "alternatives": [[_sim3(transform), score] for transform, score in pose.alternatives],
        }
    )


def pose_from_json(text: str) -> Pose:
    """The inverse of `pose_to_json`."""
    fields = json.loads(text)
    box = OrientedBox(np.array(fields["box"]["world_from_object"]), np.array(fields["box"]["extent_m"]))
    alternatives = tuple((_as_sim3(transform), score) for transform, score in fields["alternatives"])
    return Pose(
        _as_sim3(fields["target_from_reference"]),
        box,
        fields["inliers"],
        fields["correspondences"],
        fields["best_view"],
        fields["residual_m"],
        fields["score"],
        fields["confidence"],
        alternatives,
    )


def _sim3(transform: Sim3) -> dict[str, Any]:
    return {"scale": transform.scale, "rotation": transform.rotation.tolist(), "translation": transform.translation.tolist()}


def _as_sim3(fields: dict[str, Any]) -> Sim3:
    rotation: NDArray[np.floating] = np.array(fields["rotation"])
    return Sim3(fields["scale"], rotation, np.array(fields["translation"]))
