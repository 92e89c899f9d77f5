"""Recordings of two objects of a category, an exact similarity apart."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import cv2
import numpy as np
import pytest

from benchmarks import parallel
from core.camera_poses import hemisphere
from core.sim3 import Sim3

HALF_AXES = np.array([0.5, 0.35, 0.25]) / np.linalg.norm([1.0, 0.7, 0.5])
"""Of the ellipsoid in the model frame, whose bounding box has diagonal 1."""
DISTANCE = 3.0
"""Of the cameras, in object diagonals."""
DEPTH_SCALE_MM = 0.1


@pytest.fixture
def small_world(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, backbone: Any) -> Callable[[ModuleType], None]:
    """small_world(benchmark): it runs with the colour backbone, a cache of its own, and in this process."""
    monkeypatch.setenv("ONELOOK_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(parallel, "worker_count", lambda jobs: 1)  # a process of its own takes seconds to import torch
    return lambda benchmark: monkeypatch.setattr(benchmark, "load_backbone", lambda name: backbone)


def travelled(function: Callable[[Any], Any], jobs: list[Any], *_: object) -> list[Any]:
    """As `map_jobs`: what goes to processes and comes back is pickled, though they are none."""
    return [pickle.loads(pickle.dumps(function(pickle.loads(pickle.dumps(job))))) for job in jobs]


@pytest.fixture
def recorded(tmp_path: Path, ellipsoid: Any) -> Path:
    """A data folder: category `egg`, objects `large` and `small`, four views each, in worlds of their own."""
    turn = Sim3.from_matrix(np.array([[0, -1, 0, 0.0], [1, 0, 0, 0.0], [0, 0, 1, 0.0], [0, 0, 0, 1]]))
    egg = ellipsoid(HALF_AXES)
    record(tmp_path / "data" / "egg" / "large", egg, Sim3(0.5, np.eye(3), np.array([0.2, -0.1, 0.4])))
    record(tmp_path / "data" / "egg" / "small", egg, Sim3(0.3, turn.rotation, np.array([-0.3, 0.5, 0.1])))
    return tmp_path / "data"


@pytest.fixture
def two_kinds(recorded: Path, ellipsoid: Any) -> Path:
    """Two eggs, and two flat things of other colours."""
    flat = ellipsoid(np.array([0.5, 0.5, 0.15]) / np.linalg.norm([1.0, 1.0, 0.3]), colour=(120, -90))
    for name, scale in (("a", 0.4), ("b", 0.5)):
        record(recorded / "plate" / name, flat, Sim3(scale, np.eye(3), np.array([0.1, 0.2, 0.3])))
    return recorded


def record(folder: Path, ellipsoid: Any, world_from_model: Sim3, views: int = 4) -> None:
    """Writes views of an ellipsoid with exact depth, masks and ground truth."""
    cameras, truth = {}, {}
    for name in ("rgb", "depth", "mask_visib"):
        (folder / name).mkdir(parents=True)
    poses = hemisphere(world_from_model.translation, np.array([0.0, 0.0, 1.0]), DISTANCE * world_from_model.scale, views)
    for index, pose in enumerate(poses):
        view = ellipsoid.view(world_from_model, pose)
        cv2.imwrite(str(folder / "rgb" / f"{index:06}.png"), view.rgb[..., ::-1])
        cv2.imwrite(str(folder / "depth" / f"{index:06}.png"), np.round(view.depth_m * 1000 / DEPTH_SCALE_MM).astype(np.uint16))
        cv2.imwrite(str(folder / "mask_visib" / f"{index:06}_000000.png"), (view.depth_m > 0).astype(np.uint8) * 255)
        camera_from_world = view.camera.camera_from_world
        camera_from_model = camera_from_world[:3, :3] @ world_from_model.rotation
        offset_mm = 1000 * (camera_from_world[:3, :3] @ world_from_model.translation + camera_from_world[:3, 3])
        cameras[str(index)] = {
            "cam_K": view.camera.K.ravel().tolist(),
            "depth_scale": DEPTH_SCALE_MM,
            "cam_R_w2c": camera_from_world[:3, :3].ravel().tolist(),
            "cam_t_w2c": (1000 * camera_from_world[:3, 3]).tolist(),
        }
        truth[str(index)] = [{"obj_id": 1, "cam_R_m2c": camera_from_model.ravel().tolist(), "cam_t_m2c": offset_mm.tolist()}]
    about = {"category": folder.parent.name, "instance": folder.name, "model_scale_mm": 1000 * world_from_model.scale, "symmetries": []}
    for name, content in (("scene_camera", cameras), ("scene_gt", truth), ("sequence", about)):
        (folder / f"{name}.json").write_text(json.dumps(content))
