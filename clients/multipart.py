"""How a burst travels: one JSON part and the images."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from core.errors import InvalidInput
from core.views import Burst, View

DEPTH_UNIT_M = 0.001
"""Depth travels as 16-bit integers of this unit, as RGB-D cameras give it; 65 m reach."""
JPEG_QUALITY = 95
Part = tuple[str, tuple[str, bytes, str]]
"""(field, (file name, content, media type)), as httpx takes it."""


def burst_parts(burst: Burst, frame: str | None = None) -> list[Part]:
    """The multipart/form-data parts of `burst`. Raises InvalidInput where only some views have depth, a mask or a camera."""
    views = burst.views
    about: dict[str, Any] = {"depth_scale": DEPTH_UNIT_M}
    if frame is not None:
        about["frame"] = frame
    if _all_or_none("camera", [view.camera for view in views]):
        about["views"] = [{"K": camera.K.tolist(), "world_from_camera": camera.world_from_camera.tolist()} for camera in burst.cameras]
    parts = [("burst", ("burst.json", json.dumps(about).encode(), "application/json"))]
    parts += [_image("rgb", index, _jpeg(view)) for index, view in enumerate(views)]
    if _all_or_none("depth", [view.depth_m for view in views]):
        parts += [_image("depth", index, _depth_png(view, index)) for index, view in enumerate(views)]
    if _all_or_none("mask", [view.mask for view in views]):
        parts += [_image("mask", index, _encode(".png", np.asarray(view.mask, dtype=np.uint8) * 255)) for index, view in enumerate(views)]
    return parts


def _all_or_none(name: str, values: Sequence[object | None]) -> bool:
    missing = [index for index, value in enumerate(values) if value is None]
    if missing and len(missing) < len(values):
        raise InvalidInput(f"views[{missing[0]}].{name}", "is missing though other views have it; send it for all views or for none")
    return not missing


def _image(field: str, index: int, content: bytes) -> Part:
    suffix, media_type = ("jpg", "image/jpeg") if field == "rgb" else ("png", "image/png")
    return field, (f"{index:06}.{suffix}", content, media_type)


def _jpeg(view: View) -> bytes:
    return _encode(".jpg", cv2.cvtColor(view.rgb, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])


def _depth_png(view: View, index: int) -> bytes:
    assert view.depth_m is not None
    units = np.round(view.depth_m / DEPTH_UNIT_M)
    if units.max() > np.iinfo(np.uint16).max:
        reach_m = np.iinfo(np.uint16).max * DEPTH_UNIT_M
        raise InvalidInput(f"views[{index}].depth", f"reaches {view.depth_m.max():.1f} m; set what is beyond {reach_m:.0f} m to 0")
    return _encode(".png", units.astype(np.uint16))


def _encode(suffix: str, image: NDArray[Any], options: Sequence[int] = ()) -> bytes:
    _, encoded = cv2.imencode(suffix, image, list(options))
    return bytes(encoded)
