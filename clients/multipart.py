"""How a burst travels: one JSON part and the images, or one npz file."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import simplejpeg

from clients.png import encode_png
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
    parts += [_image("rgb", index, encode_colour(view)) for index, view in enumerate(views)]
    if _all_or_none("depth", [view.depth_m for view in views]):
        parts += [_image("depth", index, encode_depth(view, f"views[{index}].depth")) for index, view in enumerate(views)]
    if _all_or_none("mask", [view.mask for view in views]):
        parts += [_image("mask", index, encode_mask(view)) for index, view in enumerate(views)]
    return parts


def burst_npz(burst: Burst) -> bytes:
    """The application/x-npz body of `burst`: exact, and many times larger than the parts.

    Raises InvalidInput as `burst_parts`, and where views differ in size.
    """
    views = burst.views
    sizes = {view.size for view in views}
    if len(sizes) > 1:
        raise InvalidInput("views", f"have {len(sizes)} sizes of images, and an npz has one array for all; send them as multipart")
    arrays = {"rgb": np.stack([view.rgb for view in views])}
    if _all_or_none("camera", [view.camera for view in views]):
        arrays["K"] = np.stack([camera.K for camera in burst.cameras])
        arrays["world_from_camera"] = np.stack([camera.world_from_camera for camera in burst.cameras])
    for name, values in (("depth_m", [view.depth_m for view in views]), ("mask", [view.mask for view in views])):
        if _all_or_none(name, values):
            arrays[name] = np.stack([value for value in values if value is not None])
    stream = io.BytesIO()
    np.savez_compressed(stream, allow_pickle=False, **arrays)
    return stream.getvalue()


def _all_or_none(name: str, values: Sequence[object | None]) -> bool:
    missing = [index for index, value in enumerate(values) if value is None]
    if missing and len(missing) < len(values):
        raise InvalidInput(f"views[{missing[0]}].{name}", "is missing though other views have it; send it for all views or for none")
    return not missing


def _image(field: str, index: int, content: bytes) -> Part:
    suffix, media_type = ("jpg", "image/jpeg") if field == "rgb" else ("png", "image/png")
    return field, (f"{index:06}.{suffix}", content, media_type)


def encode_colour(view: View) -> bytes:
    """A view's colour as JPEG."""
    return bytes(simplejpeg.encode_jpeg(np.ascontiguousarray(view.rgb), quality=JPEG_QUALITY, colorsubsampling="420"))


def encode_mask(view: View) -> bytes:
    """A view's silhouette as an 8-bit PNG: 255 on the object."""
    return encode_png(np.asarray(view.mask, dtype=np.uint8) * 255)


def encode_depth(view: View, field: str) -> bytes:
    """A view's depth as a 16-bit PNG in units of DEPTH_UNIT_M. Raises InvalidInput naming `field` where it reaches too far."""
    assert view.depth_m is not None
    units = np.round(view.depth_m / DEPTH_UNIT_M)
    if units.max() > np.iinfo(np.uint16).max:
        reach_m = np.iinfo(np.uint16).max * DEPTH_UNIT_M
        raise InvalidInput(field, f"reaches {view.depth_m.max():.1f} m; set what is beyond {reach_m:.0f} m to 0")
    return encode_png(units.astype(np.uint16))
