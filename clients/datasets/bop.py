"""Data sets of the BOP benchmark.

DIR/SPLIT/SCENE/{rgb or gray, depth, mask_visib, scene_camera.json, scene_gt.json} and DIR/models*/models_info.json.

A sequence is one annotated object in one scene: its category is the object's number, since BOP tells instances apart and not kinds.
Where a scene's cameras have no pose, the object's own frame is the world: the object stands still in it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from clients.datasets import folders
from clients.datasets.folders import CAMERAS, TRUTH
from clients.datasets.images import is_image, read_depth, read_mask, read_rgb
from core.errors import InvalidInput
from core.sim3 import Sim3
from core.views import Camera, FloatArray, View

MODELS = "models_info.json"
TURNS = 72
"""Rotations that stand for a continuous symmetry: 5° apart."""


@dataclass(frozen=True)
class Sight:
    """One object in one image."""

    image: Path
    key: str
    """The image's number in the scene's files."""
    index: int
    """The object's place among those annotated in the image."""
    alone: bool
    """Whether nothing else is annotated in the image."""


@dataclass(frozen=True)
class BopReader(folders.Reader):
    """Reads the sights of one object."""

    sights: tuple[Sight, ...]

    def read(self, sequence: folders.Sequence, indices: Sequence[int], masks: bool) -> list[View]:
        """See `folders.Reader`. Among other objects only the silhouette says which one is meant, so it is always given."""
        cameras, truth = folders.read_json(sequence.path / CAMERAS), folders.read_json(sequence.path / TRUTH)
        return [self._view(sequence.path, self.sights[index], cameras, truth, masks) for index in indices]

    def files(self, sequence: folders.Sequence) -> list[Path]:
        """See `folders.Reader`."""
        depths = [_depth_file(sequence.path, sight) for sight in self.sights]
        masks = [_mask_file(sequence.path, sight) for sight in self.sights if not sight.alone]
        found = [path for path in [*depths, *masks] if path.exists()]
        return [*sequence.images, *found, sequence.path / CAMERAS, sequence.path / TRUTH]

    def cameras(self, sequence: folders.Sequence) -> str:
        """See `folders.Reader`: which of a scene's objects it is decides on silhouettes and, without camera poses, on the world."""
        return json.dumps([sight.index for sight in self.sights])

    def _view(self, scene: Path, sight: Sight, cameras: Mapping[str, Any], truth: Mapping[str, Any], masks: bool) -> View:
        depth_file, mask_file, entry = _depth_file(scene, sight), _mask_file(scene, sight), cameras[sight.key]
        within, depth_m = f"{scene / CAMERAS}: {sight.key}.", None
        if depth_file.exists():
            depth_m = read_depth(depth_file, float(folders.read_numbers(entry, "depth_scale", (), within)) / 1000)
        mask = read_mask(mask_file) if (masks or not sight.alone) and mask_file.exists() else None
        camera_from_model = _camera_from_model(scene, sight, truth)
        return folders.view_of(sight.image, read_rgb(sight.image), depth_m, _camera(entry, camera_from_model, within), mask)


def find_sequences(root: Path) -> list[folders.Sequence]:
    """Every annotated object of every scene below `root`. Raises InvalidInput where there is none."""
    models = _models(root)
    scenes = sorted(folder for folder, files in folders.folders_below(root) if TRUTH in files and CAMERAS in files)
    sequences = [each for scene in scenes for each in _scene(scene, root, models)]
    if not sequences:
        raise InvalidInput("data", f"no object is annotated below {root}; expected SPLIT/SCENE/{TRUTH} with {CAMERAS} and rgb/ or gray/")
    return sequences


def _scene(scene: Path, root: Path, models: Mapping[str, Mapping[str, Any]]) -> list[folders.Sequence]:
    truth, cameras = folders.read_json(scene / TRUTH), folders.read_json(scene / CAMERAS)
    colour = next((scene / name for name in ("rgb", "gray") if (scene / name).is_dir()), None)
    images = {folders.key_of(path): path for path in sorted(colour.iterdir()) if is_image(path)} if colour else {}
    sights: dict[tuple[int, int], list[Sight]] = {}
    for key in sorted(truth.keys() & images.keys() & cameras.keys(), key=int):
        seen: dict[int, int] = {}
        annotated = folders.read_list(truth, key, f"{scene / TRUTH}: ")
        for index, entry in enumerate(annotated):
            number = int(folders.read_numbers(entry, "obj_id", (), f"{scene / TRUTH}: {key}[{index}]."))
            copy = seen[number] = seen.get(number, -1) + 1
            sights.setdefault((number, copy), []).append(Sight(images[key], key, index, len(annotated) == 1))
    place = "-".join(scene.relative_to(root).parts) or scene.name
    return [
        _sequence(scene, f"{place}-{copy}" if (number, 1) in sights else place, number, found, models)
        for (number, copy), found in sorted(sights.items())
    ]


def _sequence(scene: Path, instance: str, number: int, sights: list[Sight], models: Mapping[str, Mapping[str, Any]]) -> folders.Sequence:
    truth, cameras = folders.read_json(scene / TRUTH), folders.read_json(scene / CAMERAS)
    model = models.get(str(number))
    world_from_model, longest = None, None
    if model:
        camera_from_model = _camera_from_model(scene, sights[0], truth)
        low, sides = (_along_axes(model, part, f"{MODELS}: {number}.") / 1000 for part in ("min", "size"))
        centre = low + sides / 2
        frame = Sim3(float(np.linalg.norm(sides)), np.eye(3), centre)
        within = f"{scene / CAMERAS}: {sights[0].key}."
        pose = _camera(cameras[sights[0].key], camera_from_model, within).world_from_camera @ camera_from_model
        world_from_model, longest = Sim3.from_matrix(pose) @ frame, float(sides.max())
    images = tuple(sight.image for sight in sights)
    symmetries = _symmetries(model or {}, f"{MODELS}: {number}.")
    return folders.Sequence(scene, f"{number:06}", instance, images, world_from_model, symmetries, BopReader(tuple(sights)), longest)


def _along_axes(model: Mapping[str, Any], part: str, within: str) -> FloatArray:
    return np.array([folders.read_numbers(model, f"{part}_{axis}", (), within) for axis in "xyz"])


def _camera(entry: Mapping[str, Any], camera_from_model: FloatArray, within: str) -> Camera:
    if isinstance(entry, Mapping) and "cam_R_w2c" in entry:
        return folders.read_camera(entry, within)
    return folders.camera_of(folders.read_numbers(entry, "cam_K", (3, 3), within), np.linalg.inv(camera_from_model), within)


def _camera_from_model(scene: Path, sight: Sight, truth: Mapping[str, Any]) -> FloatArray:
    """Rigid, shape (4, 4), metres."""
    entry, within = truth[sight.key][sight.index], f"{scene / TRUTH}: {sight.key}[{sight.index}]."
    pose = np.eye(4)
    pose[:3, :3] = folders.read_numbers(entry, "cam_R_m2c", (3, 3), within)
    pose[:3, 3] = folders.read_numbers(entry, "cam_t_m2c", (3,), within) / 1000
    return pose


def _symmetries(model: Mapping[str, Any], within: str) -> tuple[FloatArray, ...]:
    """Rotations, each (3, 3), of `symmetries_discrete`, and of `symmetries_continuous` in steps of 360° / TURNS."""
    discrete = tuple(folders.read_symmetry(matrix, f"{within}symmetries_discrete") for matrix in model.get("symmetries_discrete", ()))
    turned = tuple(
        np.asarray(cv2.Rodrigues(angle * axis / np.linalg.norm(axis))[0])
        for axis in (
            folders.read_numbers(symmetry, "axis", (3,), f"{within}symmetries_continuous.")
            for symmetry in model.get("symmetries_continuous", ())
        )
        for angle in np.arange(1, TURNS) * (2 * np.pi / TURNS)
    )
    return discrete + turned


def _models(root: Path) -> dict[str, Any]:
    """models_info.json of the data set, which may be named by one of its splits or scenes."""
    for folder in (root, *list(root.resolve().parents)[:2]):
        found = sorted(folder.glob(f"models*/{MODELS}"))
        if found:
            return folders.read_json(found[0])
    return {}


def _depth_file(scene: Path, sight: Sight) -> Path:
    return scene / "depth" / f"{sight.image.stem}.png"


def _mask_file(scene: Path, sight: Sight) -> Path:
    return scene / "mask_visib" / f"{sight.image.stem}_{sight.index:06}.png"


OFFERS: Mapping[str, folders.Format] = {"bop": find_sequences}
