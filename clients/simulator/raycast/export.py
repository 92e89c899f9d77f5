"""Objects of the rendered world as recordings in the data layout: what benchmarks and other tools read."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from clients.datasets.folders import ABOUT, CAMERAS, TRUTH
from clients.datasets.images import write_image
from clients.simulator.raycast.categories import RECIPES
from clients.simulator.raycast.model import Model
from clients.simulator.raycast.sensor import SensorConfig
from clients.simulator.raycast.world import UP, RaycastWorld
from clients.simulator.world import WorldObject
from core.camera_poses import look_at
from core.errors import InvalidInput
from core.views import FloatArray, View

DEPTH_UNIT_MM = 0.5
JPEG_QUALITY = 92
ELEVATION_DEG = (15.0, 70.0)
DIAGONALS = (2.0, 2.8)
"""How far away cameras are, in the object's diagonals; never nearer than NEAREST_M."""
NEAREST_M = 0.4
AIM_M = 0.02
"""Cameras aim at the object's middle, this much off."""
FRAME_SHIFT_M = 2.0


def draw_models(categories: Sequence[str], instances: int, seed: int) -> list[Model]:
    """`instances` objects of each category, all of them where none is named. Raises InvalidInput for an unknown one."""
    for category in categories:
        if category not in RECIPES:
            raise InvalidInput("category", f"{category!r} is none of {', '.join(RECIPES)}")
    return [
        RECIPES[category].make(category, seed * instances + number) for category in categories or RECIPES for number in range(instances)
    ]


def export(models: Sequence[Model], views: int, out: Path, seed: int, sensor: SensorConfig | None = None) -> Iterator[Path]:
    """Writes each object as a sequence in `out`, in a room and a world frame of its own; yields its folder when it is there.

    Raises InvalidInput where `out` is not empty.
    """
    if out.exists() and any(out.iterdir()):
        raise InvalidInput("out", f"{out} is not empty; name a new folder")
    for number, model in enumerate(models):
        rng = np.random.default_rng([seed, number])
        world = RaycastWorld(int(rng.integers(1 << 30)), sensor)
        world.show([model])
        poses = around(world.objects[0], views, rng)
        captured = [world.capture_with_mask(pose) for pose in poses]
        folder = out / model.category / model.instance
        write_sequence(folder, model, world.objects[0], captured, _any_frame(rng))
        yield folder


def around(thing: WorldObject, views: int, rng: np.random.Generator) -> list[FloatArray]:
    """Camera poses on all sides of an object, at different heights and distances, none of them exact."""
    assert thing.world_from_model is not None
    diagonal, middle = thing.world_from_model.scale, thing.world_from_model.translation
    poses = []
    first = float(rng.uniform(0, 360))
    for step in range(views):
        azimuth = np.radians(first + 360 * step / views + float(rng.normal(scale=6)))
        elevation = np.radians(float(rng.uniform(*ELEVATION_DEG)))
        distance = max(NEAREST_M, diagonal * float(rng.uniform(*DIAGONALS)))
        towards = np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
        pose = look_at(middle + distance * towards, middle + rng.normal(scale=AIM_M, size=3), UP)
        pose[:3, :3] = pose[:3, :3] @ Rotation.from_euler("z", float(rng.normal(scale=5)), degrees=True).as_matrix()
        poses.append(pose)
    return poses


def write_sequence(folder: Path, model: Model, thing: WorldObject, views: Sequence[View], scene_from_world: FloatArray) -> None:
    """One recording: images, cameras and ground truth, in a frame of its own; `scene_from_world` is rigid, shape (4, 4)."""
    assert thing.world_from_model is not None
    cameras, truth = {}, {}
    for number, view in enumerate(views):
        assert view.camera is not None
        world_from_camera = view.camera.world_from_camera
        camera_from_scene = np.linalg.inv(scene_from_world @ world_from_camera)
        pose = np.linalg.inv(world_from_camera)
        cameras[str(number)] = {
            "cam_K": view.camera.K.ravel().tolist(),
            "depth_scale": DEPTH_UNIT_MM,
            "cam_R_w2c": camera_from_scene[:3, :3].ravel().tolist(),
            "cam_t_w2c": (1000 * camera_from_scene[:3, 3]).tolist(),
        }
        rotation = pose[:3, :3] @ thing.world_from_model.rotation
        place_mm = 1000 * (pose[:3, :3] @ thing.world_from_model.translation + pose[:3, 3])
        truth[str(number)] = [{"obj_id": 1, "cam_R_m2c": rotation.ravel().tolist(), "cam_t_m2c": place_mm.tolist()}]
        _write_images(folder, number, view)
    about = {
        "category": model.category,
        "instance": model.instance,
        "diameter_mm": 1000 * model.size_m,
        "model_scale_mm": 1000 * model.size_m,
        "symmetries": [symmetry.ravel().tolist() for symmetry in model.symmetries],
        "split": "rendered",
    }
    for name, content in ((CAMERAS, cameras), (TRUTH, truth), (ABOUT, about)):
        (folder / name).write_text(json.dumps(content))


def contact_sheet(folders: Sequence[Path], columns: int, file: Path, side: int = 192) -> None:
    """One picture of the first view of each recording, `columns` of them in a row."""
    tiles = []
    for folder in folders:
        image = cv2.imread(str(folder / "rgb" / "000000.jpg"))
        assert image is not None
        height, width = image.shape[:2]
        left = (width - height) // 2
        tiles.append(cv2.resize(image[:, left : left + height], (side, side), interpolation=cv2.INTER_AREA))
    tiles += [np.full_like(tiles[0], 255)] * (-len(tiles) % columns)
    rows = [np.hstack(tiles[start : start + columns]) for start in range(0, len(tiles), columns)]
    write_image(file, np.vstack(rows), [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])


def _write_images(folder: Path, number: int, view: View) -> None:
    rgb = cv2.cvtColor(view.rgb, cv2.COLOR_RGB2BGR)
    write_image(folder / "rgb" / f"{number:06}.jpg", rgb, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    if view.depth_m is not None:
        write_image(folder / "depth" / f"{number:06}.png", np.round(view.depth_m * 1000 / DEPTH_UNIT_MM).astype(np.uint16))
    if view.mask is not None:
        write_image(folder / "mask_visib" / f"{number:06}_000000.png", view.mask.astype(np.uint8) * 255)


def _any_frame(rng: np.random.Generator) -> FloatArray:
    """A rigid transform without meaning, shape (4, 4): up need not be z in a recording."""
    frame = np.eye(4)
    frame[:3, :3] = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
    frame[:3, 3] = rng.uniform(-FRAME_SHIFT_M, FRAME_SHIFT_M, 3)
    return frame
