"""Folders with a transforms.json, as Instant-NGP and nerfstudio write them, and the synthetic scenes of NeRF before them.

A sequence is one folder; its category is the folder around it. Camera axes are OpenGL's (x right, y up, z backward), image coordinates
have the image's corner at 0. Lengths are taken for metres; structure from motion gives them in a unit of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from clients.datasets import folders
from clients.datasets.images import SUFFIXES, read_mask, read_rgba, read_units
from core.errors import InvalidInput
from core.views import Camera, FloatArray, View

FILES = ("transforms.json", "transforms_train.json")
"""The first that is there."""
AXES = np.diag([1.0, -1.0, -1.0, 1.0])
"""Between OpenGL's camera axes and OpenCV's, in either direction."""
DISTORTION = ("k1", "k2", "p1", "p2", "k3")
"""In OpenCV's order."""
PINHOLES = frozenset({"OPENCV", "PINHOLE", "SIMPLE_PINHOLE"})
MILLIMETRES = 0.001
"""nerfstudio's depth, where the file does not say."""


@dataclass(frozen=True)
class TransformsReader(folders.Reader):
    """Reads the frames of one file."""

    file: Path

    def read(self, sequence: folders.Sequence, indices: Sequence[int], masks: bool) -> list[View]:
        """See `folders.Reader`."""
        scene = folders.read_json(self.file)
        frames = _frames(scene, self.file)
        return [_view(sequence.path, sequence.images[index], {**scene, **frames[index]}, masks, self.file) for index in indices]

    def files(self, sequence: folders.Sequence) -> list[Path]:
        """See `folders.Reader`."""
        depths = [_depth_name(frame) for frame in _frames(folders.read_json(self.file), self.file)]
        return [*sequence.images, *(sequence.path / name for name in depths if name), self.file]


def find_sequences(root: Path) -> list[folders.Sequence]:
    """Every folder with such a file, `root` or below it. Raises InvalidInput where there is none."""
    files = {path.parent: path for name in reversed(FILES) for path in root.rglob(name)}
    if not files:
        raise InvalidInput("data", f"no {' or '.join(FILES)} in or below {root}")
    return [_sequence(folder.resolve(), files[folder].resolve()) for folder in sorted(files)]


def _sequence(folder: Path, file: Path) -> folders.Sequence:
    frames = _frames(folders.read_json(file), file)
    images = tuple(_image(folder, frame["file_path"], f"{file}: frames[{index}].file_path") for index, frame in enumerate(frames))
    return folders.Sequence(folder, folder.parent.name, folder.name, images, None, (), TransformsReader(file))


def _frames(scene: Mapping[str, Any], file: Path) -> list[dict[str, Any]]:
    frames = scene.get("frames")
    if not isinstance(frames, list) or not frames:
        raise InvalidInput(f"{file}: frames", "is missing or empty; expected a list with file_path and transform_matrix each")
    return sorted(frames, key=lambda frame: str(frame["file_path"]))


def _image(folder: Path, name: str, field: str) -> Path:
    """The file of a `file_path`, which the synthetic scenes of NeRF write without its suffix."""
    path = folder / name
    candidates = [path, *(path.with_name(path.name + suffix) for suffix in sorted(SUFFIXES))]
    found = next((each for each in candidates if each.is_file()), None)
    if found is None:
        raise InvalidInput(field, f"{path} is no file; expected an image below {folder}, with or without its suffix")
    return found


def _view(folder: Path, image: Path, frame: Mapping[str, Any], masks: bool, file: Path) -> View:
    rgb, mask = read_rgba(image)
    if frame.get("mask_path"):
        mask = read_mask(folder / frame["mask_path"])
    K, distortion = _intrinsics(frame, (rgb.shape[0], rgb.shape[1]), file)
    depth_m = _depth(folder, frame, (rgb.shape[0], rgb.shape[1]))
    if any(distortion):
        rgb, depth_m, mask = _undistorted(rgb, depth_m, mask, K, distortion)
    pose = np.eye(4)
    pose[:3] = np.array(frame["transform_matrix"], dtype=float)[:3]
    return View(rgb, depth_m, Camera(K, pose @ AXES), mask if masks and mask is not None and mask.any() else None)


def _intrinsics(frame: Mapping[str, Any], size: tuple[int, int], file: Path) -> tuple[FloatArray, tuple[float, ...]]:
    """K, shape (3, 3), of an image of `size` (H, W), and its distortion as OpenCV takes it."""
    model = frame.get("camera_model", "OPENCV")
    if model not in PINHOLES:
        raise InvalidInput(f"{file}: camera_model", f"expected one of {', '.join(sorted(PINHOLES))}, found {model!r}; undistort the images")
    height, width = size
    scale = width / frame.get("w", width)
    if "fl_x" in frame:
        fx = scale * frame["fl_x"]
    elif "camera_angle_x" in frame:
        fx = width / 2 / np.tan(frame["camera_angle_x"] / 2)
    else:
        raise InvalidInput(f"{file}: fl_x", "is missing; expected a focal length in pixels, or camera_angle_x in radians")
    fy = scale * frame["fl_y"] if "fl_y" in frame else fx
    cx = scale * frame["cx"] if "cx" in frame else width / 2
    cy = scale * frame["cy"] if "cy" in frame else height / 2
    K = np.array([[fx, 0, cx - 0.5], [0, fy, cy - 0.5], [0, 0, 1]])
    return K, tuple(float(frame.get(name, 0)) for name in DISTORTION)


def _depth_name(frame: Mapping[str, Any]) -> str | None:
    return frame.get("depth_file_path") or frame.get("depth_path")


def _depth(folder: Path, frame: Mapping[str, Any], size: tuple[int, int]) -> NDArray[np.float32] | None:
    """In the image's size (H, W): nerfstudio's `depth_file_path`, or Instant-NGP's `depth_path` with `integer_depth_scale`."""
    name = _depth_name(frame)
    if name is None:
        return None
    path = folder / name
    stored = np.load(path, allow_pickle=False) if path.suffix == ".npy" else read_units(path)
    if "depth_file_path" in frame:
        unit_m = frame.get("depth_unit_scale_factor", MILLIMETRES)
    elif "integer_depth_scale" in frame:
        unit_m = frame["integer_depth_scale"]
    else:
        raise InvalidInput("integer_depth_scale", f"is missing beside depth_path {name}; expected metres a unit of the depth images")
    depth_m = (stored * unit_m).astype(np.float32)
    resized = cv2.resize(np.nan_to_num(depth_m, posinf=0, neginf=0), size[::-1], interpolation=cv2.INTER_NEAREST_EXACT)
    return np.asarray(resized) if resized.any() else None


def _undistorted(
    rgb: NDArray[np.uint8],
    depth_m: NDArray[np.float32] | None,
    mask: NDArray[np.bool_] | None,
    K: FloatArray,
    distortion: tuple[float, ...],
) -> tuple[NDArray[np.uint8], NDArray[np.float32] | None, NDArray[np.bool_] | None]:
    """The same images as a camera without distortion and with the same K sees them; depth and silhouette by their nearest pixel."""
    across, down = cv2.initUndistortRectifyMap(K, np.array(distortion), np.eye(3), K, rgb.shape[1::-1], cv2.CV_32FC1)

    def remapped(image: NDArray[Any], interpolation: int) -> Any:
        return cv2.remap(image, across, down, interpolation)

    return (
        np.asarray(remapped(rgb, cv2.INTER_LINEAR)),
        None if depth_m is None else np.asarray(remapped(depth_m, cv2.INTER_NEAREST)),
        None if mask is None else np.asarray(remapped(mask.astype(np.uint8), cv2.INTER_NEAREST) > 0),
    )


OFFERS: Mapping[str, folders.Format] = {"transforms": find_sequences}
