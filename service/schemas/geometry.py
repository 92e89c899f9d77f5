"""Transforms and boxes as JSON."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, Field

from core.boxes import OrientedBox
from core.sim3 import Sim3

Vector3 = Annotated[list[float], Field(min_length=3, max_length=3)]
Matrix4 = Annotated[list[list[float]], Field(min_length=4, max_length=4)]


class Similarity(BaseModel):
    """p_b = scale · R · p_a + translation, for a transform named b_from_a."""

    scale: float = Field(description="λ > 0.", examples=[0.93])
    quaternion: Annotated[list[float], Field(min_length=4, max_length=4)] = Field(
        description="R as (w, x, y, z), w ≥ 0.", examples=[[0.71, 0.0, 0.0, 0.71]]
    )
    translation_m: Vector3 = Field(description="Metres of frame b.", examples=[[0.42, -0.1, 0.0]])
    matrix: Matrix4 = Field(description="[[λR, t], [0, 1]], row by row.")

    @staticmethod
    def of(transform: Sim3) -> Similarity:
        """From core's type."""
        return Similarity(
            scale=transform.scale,
            quaternion=transform.quaternion.tolist(),
            translation_m=transform.translation.tolist(),
            matrix=transform.as_matrix().tolist(),
        )


class Box(BaseModel):
    """An oriented box in a world frame."""

    extent_m: Vector3 = Field(description="Edge lengths along the object frame's x, y and z, metres.", examples=[[0.09, 0.12, 0.1]])
    corners_m: Annotated[list[Vector3], Field(min_length=8, max_length=8)] = Field(
        description="Corners in the burst's world frame, metres; bits 0, 1, 2 of a corner's index say which end of x, y, z it is at."
    )

    @staticmethod
    def of(box: OrientedBox) -> Box:
        """From core's type."""
        return Box(extent_m=box.extent_m.tolist(), corners_m=box.corners().tolist())
