"""How a burst travels: multipart/form-data with a JSON part `burst` and image parts, or one application/x-npz body."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from store.records import LONGEST_NAME

Numbers = list[float] | list[list[float]]


def _square(rows: int) -> BeforeValidator:
    def check(value: Any) -> Any:
        if value is None:
            return None
        try:
            numbers = np.asarray(value, dtype=float)
        except (TypeError, ValueError, OverflowError):  # rows of unequal length, no numbers, or ones of hundreds of digits
            numbers = np.empty(0)
        if numbers.size != rows * rows or numbers.ndim > 2 or not np.isfinite(numbers).all():
            raise ValueError(f"expected {rows}×{rows} finite numbers: {rows} rows of {rows}, or all {rows * rows} row by row")
        return value

    return BeforeValidator(check)


class ViewPart(BaseModel):
    """The camera of one view; leave both fields out where it is not known."""

    model_config = ConfigDict(extra="forbid")

    K: Annotated[Numbers | None, _square(3)] = Field(
        None,
        description=(
            "Intrinsics [[fx, s, cx], [0, fy, cy], [0, 0, 1]] in pixels of this rgb image, pixel centres at integers; 3×3 or 9 numbers."
        ),
    )
    world_from_camera: Annotated[Numbers | None, _square(4)] = Field(
        None,
        description=(
            "Rigid transform from OpenCV camera axes (x right, y down, z forward) to the burst's world frame, metres; 4×4 or 16 numbers."
        ),
    )


class BurstPart(BaseModel):
    """The JSON part `burst`."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "example": {
                "frame": "map",
                "depth_scale": 0.001,
                "views": [
                    {
                        "K": [[615.0, 0.0, 320.0], [0.0, 615.0, 240.0], [0.0, 0.0, 1.0]],
                        "world_from_camera": [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -0.8], [0.0, 0.0, 0.0, 1.0]],
                    }
                ],
            }
        },
    )

    frame: str | None = Field(
        None, max_length=LONGEST_NAME, description="Name of the world frame; given back with the answer, never interpreted."
    )
    depth_scale: float = Field(0.001, gt=0, le=1000, description="Metres a unit of the depth images: 0.001 for millimetres.")
    views: list[ViewPart] | None = Field(
        None, description="One camera a view, in the order of the images; left out where cameras are not known."
    )


def matrix(value: Numbers | None, rows: int) -> NDArray[np.floating] | None:
    """Numbers in either form as shape (rows, rows)."""
    return None if value is None else np.asarray(value, dtype=float).reshape(rows, rows)


_images = {"type": "array", "items": {"type": "string", "format": "binary"}}
MULTIPART: dict[str, Any] = {
    "schema": {
        "type": "object",
        "required": ["burst", "rgb"],
        "properties": {
            "burst": {"$ref": "#/components/schemas/BurstPart"},
            "rgb": _images | {"description": "Colour images, JPEG or PNG, one a view, in order."},
            "depth": _images
            | {"description": "z-depth aligned to rgb, 16-bit PNG in units of depth_scale, 0 = not measured; all or none."},
            "mask": _images | {"description": "Silhouettes, PNG, not 0 = object; all or none. Left out, the object is found by itself."},
        },
    },
    "encoding": {"burst": {"contentType": "application/json"}},
}
NPZ: dict[str, Any] = {
    "schema": {
        "type": "string",
        "format": "binary",
        "description": (
            "One npz file, nothing pickled, of V views: rgb (V, H, W, 3) uint8; optional depth_m (V, H, W) z-depth in metres, "
            "0 = not measured; optional K (V, 3, 3) or (3, 3) in pixels, with world_from_camera (V, 4, 4), metres; optional mask (V, H, W)."
        ),
    }
}
BURST_BODY: dict[str, Any] = {"required": True, "content": {"multipart/form-data": MULTIPART, "application/x-npz": NPZ}}
"""The `requestBody` of a route that takes a burst."""


class Seen(BaseModel):
    """An object that was observed before."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"example": {"observation_id": "9f1c1b8a4b0c4a0fb0a5c0b7f5a0d6c3"}})

    observation_id: str = Field(description="Of a kept observation; the request says what it takes.")


def burst_or_seen(observation: str) -> dict[str, Any]:
    """The `requestBody` of a route that takes a burst, or the id of such an observation."""
    content = BURST_BODY["content"] | {"application/json": {"schema": {"$ref": "#/components/schemas/Seen"}}}
    return {"required": True, "description": f"A burst, or as JSON the id of {observation}.", "content": content}
