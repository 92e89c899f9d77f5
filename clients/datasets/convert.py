"""Any data set, written in the data layout."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from clients.datasets.folders import ABOUT, CAMERAS, TRUTH, Sequence, load_burst
from clients.datasets.images import write_image
from core.errors import InvalidInput
from core.sim3 import Sim3
from core.views import View

STORED = frozenset({".jpg", ".jpeg", ".png"})
"""Suffixes of images that are copied as they are, where a reader did not change their pixels."""


def convert(sequences: list[Sequence], out: Path) -> Iterator[Path]:
    """Writes each sequence to OUT/CATEGORY/INSTANCE, and yields that folder when it is whole.

    Raises InvalidInput where `out` has something in it, or two sequences have one name.
    """
    if out.exists() and any(out.iterdir()):
        raise InvalidInput("out", f"{out} is not empty; name a new folder")
    names = [sequence.name for sequence in sequences]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InvalidInput("data", f"two sequences are called {twice}; convert their folders one by one")
    for sequence in sequences:
        folder = out / sequence.category / sequence.instance
        _write_sequence(sequence, folder)
        yield folder


def _write_sequence(sequence: Sequence, folder: Path) -> None:
    cameras: dict[str, Any] = {}
    truth: dict[str, Any] = {}
    for index in range(len(sequence.images)):
        view = load_burst(sequence, [index], masks=True).views[0]
        _write_rgb(view, sequence.images[index], folder / "rgb" / f"{index:06}")
        if view.mask is not None:
            write_image(folder / "mask_visib" / f"{index:06}_000000.png", view.mask.astype(np.uint8) * 255)
        if view.camera is None:
            continue
        pose = view.camera.camera_from_world
        unit_mm = _write_depth(view, folder / "depth" / f"{index:06}.png")
        cameras[str(index)] = {"cam_K": _row(view.camera.K), "depth_scale": unit_mm} | _rigid("w2c", pose[:3, :3], pose[:3, 3])
        if sequence.world_from_model is not None:
            in_camera = Sim3(1.0, pose[:3, :3], pose[:3, 3]) @ sequence.world_from_model
            truth[str(index)] = [{"obj_id": 1} | _rigid("m2c", in_camera.rotation, in_camera.translation)]
    about: dict[str, Any] = {"category": sequence.category, "instance": sequence.instance}
    if sequence.world_from_model is not None:
        about["model_scale_mm"] = 1000 * sequence.world_from_model.scale
    if sequence.longest_side_m is not None:
        about["longest_side_mm"] = 1000 * sequence.longest_side_m
    about["symmetries"] = [_row(symmetry) for symmetry in sequence.symmetries]
    for name, content in ((CAMERAS, cameras), (TRUTH, truth)):
        if content:
            (folder / name).write_text(json.dumps(content))
    # Last: it makes the folder a sequence, so that half of one is never taken for a whole.
    (folder / ABOUT).write_text(json.dumps(about, indent=1))


def _write_rgb(view: View, source: Path, stem: Path) -> None:
    """The file as it is where the view shows just its pixels, else a PNG."""
    stored = cv2.imread(str(source), cv2.IMREAD_COLOR) if source.suffix.lower() in STORED else None
    bgr = cv2.cvtColor(view.rgb, cv2.COLOR_RGB2BGR)
    if stored is not None and np.array_equal(stored, bgr):
        stem.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, stem.with_suffix(source.suffix.lower()))
    else:
        write_image(stem.with_suffix(".png"), bgr)


def _write_depth(view: View, path: Path) -> float:
    """Millimetres a unit: as fine as 16 bits allow for the farthest point; 1 where there is no depth."""
    if view.depth_m is None:
        return 1.0
    unit_mm = 1000 * float(view.depth_m.max()) / np.iinfo(np.uint16).max
    write_image(path, np.round(1000 * view.depth_m / unit_mm).astype(np.uint16))
    return unit_mm


def _rigid(name: str, rotation: NDArray[np.floating], translation_m: NDArray[np.floating]) -> dict[str, list[float]]:
    return {f"cam_R_{name}": _row(rotation), f"cam_t_{name}": _row(1000 * translation_m)}


def _row(matrix: NDArray[np.floating]) -> list[float]:
    return [float(value) for value in matrix.ravel()]
