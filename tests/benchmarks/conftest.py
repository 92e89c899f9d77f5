"""Recordings of two objects of a category, an exact similarity apart, and a backbone that reads colours."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from core.backbones.base import Features
from core.scan import hemisphere
from core.sim3 import Sim3
from core.views import Camera

SIDE = 160
K = np.array([[300.0, 0, SIDE / 2], [0, 300, SIDE / 2], [0, 0, 1]])
HALF_AXES = np.array([0.5, 0.35, 0.25]) / np.linalg.norm([1.0, 0.7, 0.5])
"""Of the ellipsoid in the model frame, whose bounding box has diagonal 1."""
DISTANCE = 3.0
"""Of the cameras, in object diagonals."""
DEPTH_SCALE_MM = 0.1


class ColourBackbone:
    """Tokens are random Fourier features of a patch's mean colour: near colours have near tokens."""

    name = "colour"
    patch_size = 4
    dim = 64
    has_saliency = True
    fingerprint = "colour-1"
    calls = 0

    def extract(self, images: np.ndarray) -> Features:
        """See `Backbone.extract`; counts its calls."""
        self.calls += 1
        rng = np.random.default_rng(0)
        waves, phases = rng.normal(scale=1 / 25, size=(3, self.dim)), rng.uniform(0, 2 * np.pi, self.dim)
        grid = images.shape[1] // self.patch_size
        colours = images.reshape(len(images), grid, self.patch_size, grid, self.patch_size, 3).mean(axis=(2, 4))
        tokens = np.cos(colours @ waves + phases).astype(np.float32)
        object_pixels = (images.max(axis=3) > 25).astype(np.float32)
        return Features(tokens, tokens.mean(axis=(1, 2)), (colours.max(axis=3) > 25).astype(np.float32), object_pixels)


@pytest.fixture
def backbone() -> ColourBackbone:
    """A new one, with no calls counted."""
    return ColourBackbone()


@pytest.fixture
def recorded(tmp_path: Path) -> Path:
    """A data folder: category `egg`, objects `large` and `small`, four views each, in worlds of their own."""
    turn = Sim3.from_matrix(np.array([[0, -1, 0, 0.0], [1, 0, 0, 0.0], [0, 0, 1, 0.0], [0, 0, 0, 1]]))
    record(tmp_path / "data" / "egg" / "large", Sim3(0.5, np.eye(3), np.array([0.2, -0.1, 0.4])))
    record(tmp_path / "data" / "egg" / "small", Sim3(0.3, turn.rotation, np.array([-0.3, 0.5, 0.1])))
    return tmp_path / "data"


def record(folder: Path, world_from_model: Sim3, views: int = 4) -> None:
    """Writes views of an ellipsoid whose colour says where on it a point is, with exact depth, masks and ground truth."""
    cameras, truth = {}, {}
    for name in ("rgb", "depth", "mask_visib"):
        (folder / name).mkdir(parents=True)
    poses = hemisphere(world_from_model.translation, np.array([0.0, 0.0, 1.0]), DISTANCE * world_from_model.scale, views)
    for index, pose in enumerate(poses):
        rgb, depth_m = render(world_from_model, Camera(K, pose))
        cv2.imwrite(str(folder / "rgb" / f"{index:06}.png"), rgb[..., ::-1])
        cv2.imwrite(str(folder / "depth" / f"{index:06}.png"), np.round(depth_m * 1000 / DEPTH_SCALE_MM).astype(np.uint16))
        cv2.imwrite(str(folder / "mask_visib" / f"{index:06}_000000.png"), (depth_m > 0).astype(np.uint8) * 255)
        camera_from_world = Camera(K, pose).camera_from_world
        camera_from_model = camera_from_world[:3, :3] @ world_from_model.rotation
        offset_mm = 1000 * (camera_from_world[:3, :3] @ world_from_model.translation + camera_from_world[:3, 3])
        cameras[str(index)] = {
            "cam_K": K.ravel().tolist(),
            "depth_scale": DEPTH_SCALE_MM,
            "cam_R_w2c": camera_from_world[:3, :3].ravel().tolist(),
            "cam_t_w2c": (1000 * camera_from_world[:3, 3]).tolist(),
        }
        truth[str(index)] = [{"obj_id": 1, "cam_R_m2c": camera_from_model.ravel().tolist(), "cam_t_m2c": offset_mm.tolist()}]
    about = {"category": folder.parent.name, "instance": folder.name, "model_scale_mm": 1000 * world_from_model.scale, "symmetries": []}
    for name, content in (("scene_camera", cameras), ("scene_gt", truth), ("sequence", about)):
        (folder / f"{name}.json").write_text(json.dumps(content))


def render(world_from_model: Sim3, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """RGB, shape (SIDE, SIDE, 3), black around the object, and depth in metres, shape (SIDE, SIDE)."""
    pixels = np.stack(np.meshgrid(np.arange(SIDE), np.arange(SIDE)), axis=-1).astype(float)
    model_from_world = world_from_model.inverse()
    origin = model_from_world.apply(camera.world_from_camera[:3, 3]) / HALF_AXES
    ahead = model_from_world.apply(camera.back_project(pixels, np.ones((SIDE, SIDE)))) / HALF_AXES - origin
    a, b, c = (ahead**2).sum(-1), (ahead * origin).sum(-1), (origin**2).sum() - 1
    root = b**2 - a * c
    depth_m = np.where(root > 0, (-b - np.sqrt(np.maximum(root, 0))) / a, 0)
    colour = 190 + 60 * (origin + ahead * depth_m[..., None])
    return np.where(depth_m[..., None] > 0, np.clip(colour, 0, 255), 0).astype(np.uint8), depth_m
