"""A burst as a folder of image files: NNN_rgb.png, NNN_depth.png, NNN_mask.png and cameras.json.

What is read is what was written, or Unavailable is raised: a picture with one wrong bit may still decode.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from core.errors import NotFound, Unavailable
from core.views import Burst, Camera, View
from store.folders import Files, read_whole

DEPTH_UNIT_M = 0.0001
"""Metres a unit of the 16-bit depth images; finer than any RGB-D camera, and reaching 6.5 m."""
CAMERAS = "cameras.json"


def write_burst(folder: Path, burst: Burst) -> None:
    """Writes every view of `burst` into `folder`, which exists."""
    (folder / CAMERAS).write_text(json.dumps([_write_view(folder, index, view) for index, view in enumerate(burst.views)]))


def read_burst(folder: Path, files: Files) -> Burst:
    """The views of `write_burst`, whose folder then had these files. Raises Unavailable where one is missing or damaged."""
    return Burst([_read_view(folder, files, index, entry) for index, entry in enumerate(_entries(folder, files))])


def read_view(folder: Path, files: Files, index: int) -> View:
    """One view of `write_burst`; the caller knows that it has this many."""
    return _read_view(folder, files, index, _entries(folder, files)[index])


def require_view(whose: str, views: int, index: int) -> None:
    """Raises NotFound for a view that something does not have."""
    if not 0 <= index < views:
        raise NotFound(f"{whose} has the views 0 to {views - 1}, not {index}")


def _name(index: int, kind: str) -> str:
    return f"{index:03d}_{kind}.png"


def _write_view(folder: Path, index: int, view: View) -> dict[str, Any]:
    _write_image(folder / _name(index, "rgb"), cv2.cvtColor(view.rgb, cv2.COLOR_RGB2BGR))
    entry: dict[str, Any] = {}
    if view.depth_m is not None:
        farthest = float(view.depth_m.max())
        unit = max(DEPTH_UNIT_M, farthest / np.iinfo(np.uint16).max)
        _write_image(folder / _name(index, "depth"), np.round(view.depth_m / unit).astype(np.uint16))
        entry["depth_scale"] = unit
    if view.mask is not None:
        _write_image(folder / _name(index, "mask"), view.mask.astype(np.uint8) * 255)
        entry["mask"] = True
    if view.camera is not None:
        entry["K"] = view.camera.K.tolist()
        entry["world_from_camera"] = view.camera.world_from_camera.tolist()
    return entry


def _read_view(folder: Path, files: Files, index: int, entry: dict[str, Any]) -> View:
    rgb = cv2.cvtColor(_read_image(folder, files, _name(index, "rgb"), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
    depth_m = mask = None
    if "depth_scale" in entry:
        raw = _read_image(folder, files, _name(index, "depth"), cv2.IMREAD_UNCHANGED)
        depth_m = (raw * entry["depth_scale"]).astype(np.float32)
    if "mask" in entry:
        mask = _read_image(folder, files, _name(index, "mask"), cv2.IMREAD_GRAYSCALE) > 0
    return View(np.asarray(rgb, dtype=np.uint8), depth_m, _camera(entry), mask)


def _camera(entry: dict[str, Any]) -> Camera | None:
    return Camera(np.array(entry["K"]), np.array(entry["world_from_camera"])) if "K" in entry else None


def _entries(folder: Path, files: Files) -> list[dict[str, Any]]:
    entries: list[dict[str, Any]] = json.loads(_content(folder, files, CAMERAS))
    return entries


def _content(folder: Path, files: Files, name: str) -> bytes:
    if name not in files:
        raise Unavailable(f"{folder / name} is missing from the memory; restore it from a backup")
    return read_whole(folder / name, files[name].sha256)


def _write_image(path: Path, image: NDArray[Any]) -> None:
    encoded = cv2.imencode(".png", image)[1]
    path.write_bytes(encoded.tobytes())


def _read_image(folder: Path, files: Files, name: str, flags: int) -> NDArray[Any]:
    image = cv2.imdecode(np.frombuffer(_content(folder, files, name), np.uint8), flags)
    if image is None:  # an import brought it, and its size and checksum were right
        raise Unavailable(f"{folder / name} is no picture; restore it from a backup")
    return np.asarray(image)
