"""What the service says of itself."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, Field


class Health(BaseModel):
    """An answer to a probe."""

    status: Literal["ok"] = "ok"


class Info(BaseModel):
    """The service and its memory."""

    version: str = Field(description="Of the distribution `onelook`.", examples=["0.1.0"])
    backbone: str = Field(examples=["dinov2-s14"])
    fingerprint: str = Field(description="Of the backbone's weights, layer and preprocessing; the memory is tied to it.")
    score: str = Field(description="How similar two bursts are, for the decision.")
    threshold: float | None = Field(description="Least similarity of a known object; null where the score or the rate decides.")
    false_known_rate: float = Field(description="Of objects of no known category, the share that may be called known.", examples=[0.01])
    variant: str = Field(description="Variant of the pose pipeline, where a request names none.", examples=["ucd"])
    categories: int = Field(description="In the memory.")
    memory_version: int = Field(description="Grows with each change of the memory.")
