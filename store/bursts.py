"""A burst as a folder of image files: NNN_rgb.png, NNN_depth.png, NNN_mask.png and cameras.json."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from core.errors import Unavailable
from core.views import Burst, Camera, View

DEPTH_UNIT_M = 0.0001
"""Metres a unit of the 16-bit depth images; finer than any RGB-D camera, and reaching 6.5 m."""
CAMERAS = "cameras.json"


def write_burst(folder: Path, burst: Burst) -> None:
    """Writes every view of `burst` into `folder`, which exists."""
    (folder / CAMERAS).write_text(json.dumps([_write_view(folder, index, view) for index, view in enumerate(burst.views)]))


def read_burst(folder: Path) -> Burst:
    """The views of `write_burst`. Raises Unavailable where a file is missing."""
    return Burst([_read_view(folder, index, entry) for index, entry in enumerate(_entries(folder))])


def read_view(folder: Path, index: int) -> View:
    """One view of `write_burst`; the caller knows that it has this many."""
    return _read_view(folder, index, _entries(folder)[index])


def read_cameras(folder: Path) -> list[Camera | None]:
    """The cameras of `write_burst`, without reading an image."""
    return [_camera(entry) for entry in _entries(folder)]


def rgb_file(folder: Path, index: int) -> Path:
    """The colour image of one view."""
    return folder / f"{index:03d}_rgb.png"


def _depth_file(folder: Path, index: int) -> Path:
    return folder / f"{index:03d}_depth.png"


def _mask_file(folder: Path, index: int) -> Path:
    return folder / f"{index:03d}_mask.png"


def _write_view(folder: Path, index: int, view: View) -> dict[str, Any]:
    _write_image(rgb_file(folder, index), cv2.cvtColor(view.rgb, cv2.COLOR_RGB2BGR))
    entry: dict[str, Any] = {}
    if view.depth_m is not None:
        farthest = float(view.depth_m.max())
        unit = max(DEPTH_UNIT_M, farthest / np.iinfo(np.uint16).max)
        _write_image(_depth_file(folder, index), np.round(view.depth_m / unit).astype(np.uint16))
        entry["depth_scale"] = unit
    if view.mask is not None:
        _write_image(_mask_file(folder, index), view.mask.astype(np.uint8) * 255)
        entry["mask"] = True
    if view.camera is not None:
        entry["K"] = view.camera.K.tolist()
        entry["world_from_camera"] = view.camera.world_from_camera.tolist()
    return entry


def _read_view(folder: Path, index: int, entry: dict[str, Any]) -> View:
    rgb = cv2.cvtColor(_read_image(rgb_file(folder, index), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
    depth_m = mask = None
    if "depth_scale" in entry:
        raw = _read_image(_depth_file(folder, index), cv2.IMREAD_UNCHANGED)
        depth_m = (raw * entry["depth_scale"]).astype(np.float32)
    if "mask" in entry:
        mask = _read_image(_mask_file(folder, index), cv2.IMREAD_GRAYSCALE) > 0
    return View(np.asarray(rgb, dtype=np.uint8), depth_m, _camera(entry), mask)


def _camera(entry: dict[str, Any]) -> Camera | None:
    return Camera(np.array(entry["K"]), np.array(entry["world_from_camera"])) if "K" in entry else None


def _entries(folder: Path) -> list[dict[str, Any]]:
    try:
        entries: list[dict[str, Any]] = json.loads((folder / CAMERAS).read_text())
    except FileNotFoundError:
        raise Unavailable(f"{folder} is missing from the memory; restore it from a backup") from None
    return entries


def _write_image(path: Path, image: NDArray[Any]) -> None:
    encoded = cv2.imencode(".png", image)[1]
    path.write_bytes(encoded.tobytes())


def _read_image(path: Path, flags: int) -> NDArray[Any]:
    image = cv2.imread(str(path), flags)
    if image is None:
        raise Unavailable(f"{path} is missing from the memory or damaged; restore it from a backup")
    return np.asarray(image)
