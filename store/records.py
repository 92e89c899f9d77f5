"""What the memory keeps, as it is handed out: frozen, with ids as plain strings and times as ISO 8601 in UTC."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from core.affine9 import Affine9
from core.boxes import OrientedBox
from core.grounds import Grounds
from core.novelty import Decision, Outcome
from core.pose_estimate import Alternative, PoseEstimate
from core.rearrange import Anchor
from core.reference import Reference
from core.scan import ScanRequest
from core.sim3 import Sim3
from core.views import Burst, FloatArray

LONGEST_NAME = 200
"""Of whatever people name."""
ScanState = Literal["requested", "collecting", "completed", "expired"]
Assignment = Literal["scan", "decision", "named"]
"""How a burst came to a category: by the scan it was learnt from, by the decision, or by the word of a caller or a person."""
Change = Literal["create", "rename", "merge", "split", "delete", "forget", "import", "reembed", "undo", "correct"]
"""Of what was learnt."""
Errand = Literal["calibrate", "backup", "export", "key", "revoke"]
"""What else only an admin may do; `key` and `revoke` are a key's beginning and end."""
Action = Literal[Change, Errand]


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
    origin_id: str
    """The id it has in the memory where it was learnt; another one after an import."""


@dataclass(frozen=True, eq=False)
class Instance:
    """A burst assigned to a category, and where it came from; its tokens are read apart."""

    id: str
    category_id: str
    created_at: str
    source: Literal["scan", "observation"]
    source_id: str | None
    """Of that scan or observation, which may be gone since; None where an earlier version did not record it."""
    how: Assignment
    similarity: float | None
    """To the category, when it was assigned; None where nobody asked."""
    views: int
    """Of its tokens."""
    pictures: str | None
    """Folder of its views below the memory's; None once they are dropped, when another backbone can no longer compute its tokens."""

    @property
    def kept(self) -> bool:
        """Whether its views are still there."""
        return self.pictures is not None


@dataclass(frozen=True, eq=False)
class Goal:
    """Where an object of a category should end."""

    id: str
    category_id: str
    created_at: str
    name: str | None
    target_from_reference: Sim3
    """Takes the reference to the place and size where it should be."""
    frame: str | None
    """Name of the world frame that the goal is in, as the caller gave it."""
    anchor: Anchor
    """Which point of another object of the category is put where the reference's is."""
    observation_id: str | None
    """The observation that the goal was taken from, while that is kept."""


@dataclass(frozen=True, eq=False)
class AuditEntry:
    """One change of what was learnt, or errand of an admin: who, what, when, and how it was before and after."""

    id: str
    created_at: str
    actor: str | None
    """Who asked for it: the name of their key where there are keys, and what the caller said."""
    action: Action
    category_id: str | None
    """The category that was changed."""
    before: Mapping[str, Any]
    after: Mapping[str, Any]
    undone_by: str | None
    """The entry that undid it."""
    undoable: bool
    """Whether `Memory.undo` may still take it back."""


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
    expires_at: str
    """When it ends unless more views come before."""


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
    alternatives: tuple[Alternative, ...]
    """Best first."""
    boxes_px: tuple[tuple[float, float, float, float] | None, ...] = ()
    """Of each view the (left, top, right, bottom) of the box's corners within the image; None where one is behind the camera."""
    target_from_object: Affine9 | None = None
    """Where 9-D was asked for: a scale of its own for each axis of the box."""
    not_9d_because: str | None = None
    symmetries: FloatArray = field(default_factory=lambda: np.empty((0, 3, 3)))
    """The reference's, about its box's centre: turned by any of them, the pose means the same. Shape (S, 3, 3)."""

    @staticmethod
    def of(estimate: PoseEstimate, reference: Reference, burst: Burst) -> Pose:
        """What is kept of an estimate for the object of a burst."""
        box = estimate.box(reference.box)
        return Pose(
            target_from_reference=estimate.target_from_reference,
            box=box,
            inliers=estimate.inliers,
            correspondences=len(estimate.matches),
            best_view=estimate.matches.best_pair(estimate.pairs)[1],
            residual_m=estimate.residual_m,
            score=estimate.score,
            confidence=estimate.confidence,
            alternatives=estimate.alternatives,
            boxes_px=tuple(box.within_image(view.camera, view.size) if view.camera else None for view in burst.views),
            target_from_object=estimate.target_from_object,
            not_9d_because=estimate.not_9d_because,
            symmetries=reference.symmetries,
        )


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
    grounds: Grounds | None
    """How much the answer rests on; None where an earlier version did not record it."""
    viewpoints: NDArray[np.floating] | None = None
    """Of an uncertain object where to look next, world_from_camera in the burst's world, most telling first, shape (n, 4, 4)."""
    corrected_to: str | None = None
    """The category that a person said it was of; None where nobody did, or where that category was deleted since."""
