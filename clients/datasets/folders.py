"""BOP-style folders: one folder a sequence, CATEGORY/INSTANCE/{rgb,depth,mask_visib,scene_*.json,sequence.json}."""

from __future__ import annotations

import json
from collections.abc import Sequence as Indices
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from core.errors import InvalidInput
from core.sim3 import Sim3
from core.views import Burst, Camera, FloatArray, View


@dataclass(frozen=True, eq=False)
class Sequence:
    """One recorded object."""

    path: Path
    category: str
    instance: str
    images: tuple[Path, ...]
    """RGB files, one a view, in order."""
    world_from_model: Sim3 | None
    """Ground truth for evaluation: the model frame (unit diagonal, canonical orientation) in this sequence's world, metres."""
    symmetries: tuple[FloatArray, ...]
    """Rotations of the model onto itself, each (3, 3)."""

    @property
    def name(self) -> str:
        """`category/instance`."""
        return f"{self.category}/{self.instance}"


def find_sequences(root: Path) -> list[Sequence]:
    """Every sequence below `root`, sorted by path. Raises InvalidInput where there is none."""
    folders = sorted(path.parent for path in root.rglob("sequence.json"))
    if not folders:
        raise InvalidInput("data", f"no sequence.json below {root}; expected CATEGORY/INSTANCE/sequence.json")
    return [_read_sequence(folder) for folder in folders]


def load_burst(sequence: Sequence, indices: Indices[int] | None = None, *, masks: bool = False) -> Burst:
    """The views of `sequence` at `indices` (all where left out); silhouettes only where `masks` asks for them."""
    cameras = _read_json(sequence.path / "scene_camera.json")
    chosen = range(len(sequence.images)) if indices is None else indices
    return Burst([_load_view(sequence, sequence.images[index], cameras, masks) for index in chosen])


def _load_view(sequence: Sequence, image: Path, cameras: dict[str, Any], masks: bool) -> View:
    rgb = cv2.cvtColor(_read_image(image, cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
    entry = cameras.get(str(int(image.stem)))
    if entry is None or "cam_R_w2c" not in entry:
        return View(rgb)
    depth_file = sequence.path / "depth" / f"{image.stem}.png"
    depth_m = None
    if depth_file.exists():
        raw = _read_image(depth_file, cv2.IMREAD_UNCHANGED)
        depth_m = (raw * (entry["depth_scale"] / 1000)).astype(np.float32)
    mask_file = sequence.path / "mask_visib" / f"{image.stem}_000000.png"
    mask = _read_image(mask_file, cv2.IMREAD_GRAYSCALE) > 0 if masks and mask_file.exists() else None
    return View(rgb, depth_m, _read_camera(entry), mask)


def _read_camera(entry: dict[str, Any]) -> Camera:
    rotation = np.array(entry["cam_R_w2c"], dtype=float).reshape(3, 3)
    world_from_camera = np.eye(4)
    world_from_camera[:3, :3] = rotation.T
    world_from_camera[:3, 3] = -rotation.T @ np.array(entry["cam_t_w2c"], dtype=float) / 1000
    return Camera(np.array(entry["cam_K"], dtype=float).reshape(3, 3), world_from_camera)


def _read_sequence(folder: Path) -> Sequence:
    about = json.loads((folder / "sequence.json").read_text())
    images = tuple(sorted(path for path in (folder / "rgb").iterdir() if path.suffix in {".jpg", ".png"}))
    symmetries = tuple(np.array(matrix, dtype=float).reshape(-1)[:9].reshape(3, 3) for matrix in about.get("symmetries", ()))
    return Sequence(folder, about["category"], about["instance"], images, _world_from_model(folder, about), symmetries)


def _world_from_model(folder: Path, about: dict[str, Any]) -> Sim3 | None:
    truth, cameras = _read_json(folder / "scene_gt.json"), _read_json(folder / "scene_camera.json")
    if not truth or not cameras:
        return None
    first = next(iter(truth))
    pose, camera = truth[first][0], _read_camera(cameras[first])
    camera_from_model = Sim3(
        about["model_scale_mm"] / 1000,
        np.array(pose["cam_R_m2c"], dtype=float).reshape(3, 3),
        np.array(pose["cam_t_m2c"], dtype=float) / 1000,
    )
    return Sim3(1.0, camera.world_from_camera[:3, :3], camera.world_from_camera[:3, 3]) @ camera_from_model


def _read_json(path: Path) -> dict[str, Any]:
    return dict(json.loads(path.read_text())) if path.exists() else {}


def _read_image(path: Path, flags: int) -> Any:
    image = cv2.imread(str(path), flags)
    if image is None:
        raise InvalidInput(str(path), "is not a readable image")
    return image
