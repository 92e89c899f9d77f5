"""What the service says of itself."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, Field

from service.schemas.fields import FalseKnownRate, Score, Threshold


class Health(BaseModel):
    """An answer to a probe."""

    status: Literal["ok"] = "ok"


class Info(BaseModel):
    """The service and its memory."""

    version: str = Field(description="Of the distribution `onelook`.", examples=["0.1.0"])
    backbone: str = Field(examples=["dinov2-s14"])
    fingerprint: str = Field(description="Of the backbone's weights, layer and preprocessing; the memory is tied to it.")
    score: Score
    threshold: Threshold
    false_known_rate: FalseKnownRate
    variant: str = Field(description="Variant of the pose pipeline, where a request names none.", examples=["best"])
    categories: int = Field(description="In the memory.")
    memory_version: int = Field(description="Grows with each change of the memory.")
