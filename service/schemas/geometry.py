"""Transforms and boxes as JSON."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import BaseModel, Field

from core.affine9 import Affine9
from core.boxes import OrientedBox
from core.sim3 import Sim3
from core.views import FloatArray

Vector3 = Annotated[list[float], Field(min_length=3, max_length=3)]
Direction = Annotated[list[Annotated[float, Field(allow_inf_nan=False)]], Field(min_length=3, max_length=3)]
Quaternion = Annotated[list[float], Field(min_length=4, max_length=4)]
Matrix4 = Annotated[list[list[float]], Field(min_length=4, max_length=4)]


def as_up(direction: list[float] | None) -> tuple[float, float, float] | None:
    """Three numbers, as core takes them."""
    if direction is None:
        return None
    x, y, z = direction
    return x, y, z


class Similarity(BaseModel):
    """p_b = scale · R · p_a + translation, for a transform named b_from_a."""

    scale: float = Field(description="λ > 0.", examples=[0.93])
    quaternion: Quaternion = Field(description="R as (w, x, y, z), w ≥ 0.", examples=[[0.71, 0.0, 0.0, 0.71]])
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


class Rigid(BaseModel):
    """p_b = R · p_a + translation, for a transform named b_from_a."""

    quaternion: Quaternion = Field(description="R as (w, x, y, z), w ≥ 0.", examples=[[0.71, 0.0, 0.0, 0.71]])
    translation_m: Vector3 = Field(description="Metres of frame b.", examples=[[0.42, -0.1, 0.0]])
    matrix: Matrix4 = Field(description="[[R, t], [0, 1]], row by row.")

    @staticmethod
    def of(matrix: FloatArray) -> Rigid:
        """From shape (4, 4)."""
        return Rigid(quaternion=Sim3.from_matrix(matrix).quaternion.tolist(), translation_m=matrix[:3, 3].tolist(), matrix=matrix.tolist())


class Stretch(BaseModel):
    """p_b = R · (scales ∘ p_a) + translation: a scale of its own for each axis of frame a."""

    scales: Vector3 = Field(description="Positive.", examples=[[0.9, 1.1, 1.0]])
    quaternion: Quaternion = Field(description="R as (w, x, y, z), w ≥ 0.", examples=[[0.71, 0.0, 0.0, 0.71]])
    translation_m: Vector3 = Field(description="Metres of frame b.", examples=[[0.42, -0.1, 0.0]])
    matrix: Matrix4 = Field(description="[[R diag(scales), t], [0, 1]], row by row.")

    @staticmethod
    def of(transform: Affine9) -> Stretch:
        """From core's type."""
        return Stretch(
            scales=np.asarray(transform.scales).tolist(),
            quaternion=Sim3(1.0, transform.rotation, transform.translation).quaternion.tolist(),
            translation_m=np.asarray(transform.translation).tolist(),
            matrix=transform.as_matrix().tolist(),
        )
