"""The messages of WS /v1/track, each one JSON text."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Mapping
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from core.errors import InvalidInput
from core.novelty import Outcome
from core.tracking import TrackConfig
from core.views import Camera, View
from service.decoding import naming
from service.images import decode_colour, decode_depth, decode_mask
from service.plausibility import plausible
from service.schemas.bursts import ViewPart, matrix
from service.schemas.geometry import Box, Matrix4, Similarity
from service.schemas.observations import CategorySimilarity
from service.schemas.problem import Problem
from service.tracker import Frame, TrackOptions, Update

LARGEST_WINDOW = 16


def _bytes(value: object) -> object:
    try:
        return base64.b64decode(value, validate=True) if isinstance(value, str) else value
    except binascii.Error:
        raise ValueError("is not base64") from None


Image = Annotated[bytes, BeforeValidator(_bytes)]


class Hello(BaseModel):
    """The first message to the service."""

    model_config = ConfigDict(extra="forbid")

    type: Literal["hello"]
    category_id: str | None = Field(None, description="Of the object; decided from the first frames where left out.")
    window: int = Field(TrackOptions.window, ge=1, le=LARGEST_WINDOW, description="Views that a pose rests on, the latest ones.")
    variant: str = Field(TrackOptions.variant, description="Variant of the pose pipeline.")
    weight: float = Field(TrackConfig.weight, gt=0, le=1, description="Of a new pose against the last one; 1 smooths nothing.")
    seed: int = Field(TrackOptions.seed, ge=0, lt=2**31)

    def options(self) -> TrackOptions:
        """As the tracker has them."""
        return TrackOptions(self.category_id, self.window, self.variant, self.seed, TrackConfig(weight=self.weight))


class FrameMessage(ViewPart):
    """One view."""

    type: Literal["frame"]
    id: int = Field(description="Given back with what is said of it.")
    time_s: float | None = Field(None, allow_inf_nan=False, description="When it was taken, on any clock; its arrival where left out.")
    depth_scale: float = Field(0.001, gt=0, le=1000, description="Metres a unit of the depth image.")
    rgb: Image = Field(description="A JPEG or PNG, base64.")
    depth: Image = Field(description="A 16-bit PNG aligned to it, base64.")
    mask: Image | None = Field(None, description="A PNG, not 0 on the object, base64.")

    def decode(self, arrived_s: float) -> Frame:
        """The frame; raises InvalidInput naming what is wrong with it."""
        K, pose = matrix(self.K, 3), matrix(self.world_from_camera, 4)
        for name, value in (("K", K), ("world_from_camera", pose)):
            if value is None:
                raise InvalidInput(name, "is missing; following an object needs the camera of every frame")
        assert K is not None
        assert pose is not None
        depth_m = (decode_depth(self.depth, "depth") * self.depth_scale).astype(np.float32)
        mask = None if self.mask is None else decode_mask(self.mask, "mask")
        rgb = decode_colour(self.rgb, "rgb")
        with naming(""):
            view = plausible(View(rgb, depth_m, Camera(K, pose), mask))
        return Frame(self.id, view, arrived_s if self.time_s is None else self.time_s)


class Ready(BaseModel):
    """The answer to `hello`."""

    type: Literal["ready"] = "ready"
    category_id: str | None
    window: int
    weight: float


class TrackedPose(BaseModel):
    """Where the object is."""

    target_from_reference: Similarity
    world_from_object: Matrix4
    box: Box


class FrameAnswer(BaseModel):
    """The answer to each frame that is not dropped."""

    type: Literal["pose"] = "pose"
    frame_id: int
    category_id: str | None
    pose: TrackedPose | None = Field(description="Smoothed; null where the object is not found.")
    measured: bool = Field(description="Whether this frame gave it; false where the last pose is held.")
    views: int = Field(description="That it rests on.")
    data_age_s: float | None = Field(
        description="How old what it was computed from is on average, smoothing included: its lag behind an object that moves."
    )
    reason: str | None = Field(description="Why this frame gave no pose.")
    outcome: Outcome | None = Field(description="Where the category was decided with this frame, or could not be.")
    similarities: list[CategorySimilarity] = Field(
        description="Then the categories, most similar first; with the score `best` those few that match best."
    )
    latency_ms: float = Field(description="From the frame's arrival to this answer.")

    @staticmethod
    def of(update: Update, category_id: str | None, names: Mapping[str, str | None], latency_ms: float) -> FrameAnswer:
        """From the tracker's answer."""
        pose = None
        if update.pose is not None and update.box is not None:
            pose = TrackedPose(
                target_from_reference=Similarity.of(update.pose),
                world_from_object=update.box.world_from_object.tolist(),
                box=Box.of(update.box),
            )
        decision = update.decision
        return FrameAnswer(
            frame_id=update.frame_id,
            category_id=category_id,
            pose=pose,
            measured=update.measured,
            views=update.views,
            data_age_s=update.data_age_s,
            reason=update.reason,
            outcome=decision.outcome if decision else None,
            similarities=[
                CategorySimilarity(category_id=each, name=names.get(each), similarity=value)
                for each, value in (decision.similarities if decision else ())
            ],
            latency_ms=latency_ms,
        )


class Announcement(BaseModel):
    """That the object was found or lost."""

    type: Literal["found", "lost"]
    frame_id: int


class Dropped(BaseModel):
    """That frames came faster than they were worked on or their answers taken; the oldest that waited were dropped."""

    type: Literal["dropped"] = "dropped"
    frames: int
    first_id: int
    last_id: int


class TrackProblem(BaseModel):
    """That a message could not be used; the connection stays open unless it was `hello`."""

    type: Literal["problem"] = "problem"
    frame_id: int | None
    problem: Problem
