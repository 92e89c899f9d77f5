"""Following an object: the messages of WS /v1/track, and what the service answers to each frame."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from clients.answers.observations import Outcome, sim3_from_json
from clients.calls.call import given
from clients.errors import problem_from_json
from clients.multipart import DEPTH_UNIT_M, encode_colour, encode_depth, encode_mask
from core.errors import InvalidInput
from core.sim3 import Sim3
from core.views import FloatArray, View

PATH = "/v1/track"
MAX_MESSAGE_BYTES = 1 << 20
"""Of an answer, whose images stay here."""


@dataclass(frozen=True, eq=False)
class TrackedPose:
    """Where the object is, smoothed."""

    target_from_reference: Sim3
    """From the world frame of the reference scan to the frames' world, metres both."""
    world_from_object: FloatArray
    """Rigid, shape (4, 4), metres: the object's box."""
    extent_m: FloatArray
    """Edge lengths of its box, shape (3,)."""
    corners_m: FloatArray
    """Shape (8, 3)."""


@dataclass(frozen=True, eq=False)
class Tracked:
    """The answer to one frame."""

    frame_id: int
    category_id: str | None
    pose: TrackedPose | None
    """None where the object is not found."""
    measured: bool
    """Whether this frame gave the pose; else the last one is held."""
    views: int
    """That it rests on."""
    data_age_s: float | None
    """How old what it was computed from is on average."""
    reason: str | None
    """Why this frame gave no pose."""
    outcome: Outcome | None
    """Where the category was decided with this frame, or could not be."""
    latency_ms: float
    changes: tuple[str, ...]
    """`found` or `lost`, where it was with this frame."""


@dataclass
class Conversation:
    """What is said in one connection, in turn: a frame, then all that the service says until its answer."""

    _next: int = 0
    _changes: list[str] = field(default_factory=list)

    def hello(self, **options: Any) -> str:
        """The first message; without options that are None."""
        return json.dumps({"type": "hello", **given(**options)})

    def frame(self, view: View, time_s: float | None = None) -> str:
        """The message of one view. Raises InvalidInput where it has no depth or no camera."""
        for name, value in (("depth", view.depth_m), ("camera", view.camera)):
            if value is None:
                raise InvalidInput(name, "is missing; following an object needs depth and the camera of every frame")
        assert view.camera is not None
        message = {
            "type": "frame",
            "id": self._next,
            "time_s": time_s,
            "depth_scale": DEPTH_UNIT_M,
            "K": view.camera.K.tolist(),
            "world_from_camera": view.camera.world_from_camera.tolist(),
            "rgb": _base64(encode_colour(view)),
            "depth": _base64(encode_depth(view, "depth")),
        }
        if view.mask is not None:
            message["mask"] = _base64(encode_mask(view))
        self._next += 1
        return json.dumps(message)

    def read(self, text: str | bytes) -> Tracked | None:
        """The answer, if this message is one. Raises the ServiceProblem that it tells of."""
        message = json.loads(text)
        kind = message["type"]
        if kind == "problem":
            problem = message["problem"]
            raise problem_from_json(problem["status"], problem)
        if kind in {"found", "lost"}:
            self._changes.append(kind)
        if kind != "pose":
            return None
        changes, self._changes = tuple(self._changes), []
        pose = _pose(message["pose"]) if message["pose"] else None
        plain = ("measured", "views", "data_age_s", "reason", "outcome", "latency_ms")
        return Tracked(message["frame_id"], message["category_id"], pose, changes=changes, **{name: message[name] for name in plain})


def websocket_url(base: str) -> str:
    """Where an object is followed, of the service at `base`."""
    return "ws" + base.removeprefix("http").rstrip("/") + PATH


def _pose(fields: Mapping[str, Any]) -> TrackedPose:
    box = fields["box"]
    transform, placed = sim3_from_json(fields["target_from_reference"]), np.array(fields["world_from_object"])
    return TrackedPose(transform, placed, np.array(box["extent_m"]), np.array(box["corners_m"]))


def _base64(content: bytes) -> str:
    return base64.b64encode(content).decode("ascii")
