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
from core.views import FloatArray, View

FILES = ("transforms.json", "transforms_train.json")
"""The first that is there."""
AXES = np.diag([1.0, -1.0, -1.0, 1.0])
"""Between OpenGL's camera axes and OpenCV's, in either direction."""
DISTORTION = ("k1", "k2", "p1", "p2", "k3")
"""In OpenCV's order."""
PINHOLES = ("OPENCV", "PINHOLE", "SIMPLE_PINHOLE")
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
        chosen = [(sequence.images[index], *frames[index]) for index in indices]
        return [_view(sequence.path, image, {**scene, **frame}, masks, within) for image, within, frame in chosen]

    def files(self, sequence: folders.Sequence) -> list[Path]:
        """See `folders.Reader`."""
        depths = [_depth_name(frame, within) for within, frame in _frames(folders.read_json(self.file), self.file)]
        return [*sequence.images, *(sequence.path / name for name in depths if name), self.file]


def find_sequences(root: Path) -> list[folders.Sequence]:
    """Every folder with such a file, `root` or below it. Raises InvalidInput where there is none."""
    found = [(folder, [name for name in FILES if name in files]) for folder, files in sorted(folders.folders_below(root))]
    sequences = [_sequence(folder.resolve(), (folder / names[0]).resolve()) for folder, names in found if names]
    if not sequences:
        raise InvalidInput("data", f"no {' or '.join(FILES)} in or below {root}")
    return sequences


def _sequence(folder: Path, file: Path) -> folders.Sequence:
    frames = _frames(folders.read_json(file), file)
    images = tuple(_image(folder, frame["file_path"], f"{within}file_path") for within, frame in frames)
    return folders.Sequence(folder, folder.parent.name, folder.name, images, None, (), TransformsReader(file))


def _frames(scene: Mapping[str, Any], file: Path) -> list[tuple[str, dict[str, Any]]]:
    """What each frame's fields are named after, such as `FILE: frames[7].`, and the frame, in the order of their images' names."""
    frames = scene.get("frames")
    if not isinstance(frames, list) or not frames:
        raise InvalidInput(f"{file}: frames", "is missing or empty; expected a list with file_path and transform_matrix each")
    named = [(f"{file}: frames[{index}].", frame) for index, frame in enumerate(frames)]
    for within, frame in named:
        if not (isinstance(frame, dict) and isinstance(frame.get("file_path"), str)):
            raise InvalidInput(f"{within}file_path", f"expected the name of an image, found {frame!r:.80}")
    return sorted(named, key=lambda each: str(each[1]["file_path"]))


def _image(folder: Path, name: str, field: str) -> Path:
    """The file of a `file_path`, which the synthetic scenes of NeRF write without its suffix."""
    path = folder / name
    candidates = [path, *(path.with_name(path.name + suffix) for suffix in sorted(SUFFIXES))]
    found = next((each for each in candidates if each.is_file()), None)
    if found is None:
        raise InvalidInput(field, f"{path} is no file; expected an image below {folder}, with or without its suffix")
    return found


def _view(folder: Path, image: Path, frame: Mapping[str, Any], masks: bool, within: str) -> View:
    """`frame` has the scene's fields, too, where it has none of its own."""
    rgb, mask = read_rgba(image)
    if masks and (name := _file_name(frame, "mask_path", within)):
        mask = read_mask(folder / name)
    K, distortion = _intrinsics(frame, (rgb.shape[0], rgb.shape[1]), within)
    depth_m = _depth(folder, frame, (rgb.shape[0], rgb.shape[1]), within)
    if any(distortion):
        rgb, depth_m, mask = _undistorted(rgb, depth_m, mask, K, distortion)
    pose = np.eye(4)
    given = frame.get("transform_matrix")
    rows = 3 if isinstance(given, list) and len(given) == 3 else 4  # some leave out the last
    pose[:3] = folders.read_numbers(frame, "transform_matrix", (rows, 4), within)[:3]
    camera = folders.camera_of(K, pose @ AXES, within)
    return folders.view_of(image, rgb, depth_m, camera, mask if masks and mask is not None and mask.any() else None)


def _intrinsics(frame: Mapping[str, Any], size: tuple[int, int], within: str) -> tuple[FloatArray, tuple[float, ...]]:
    """K, shape (3, 3), of an image of `size` (H, W), and its distortion as OpenCV takes it."""

    def given(name: str) -> float:
        return float(folders.read_numbers(frame, name, (), within))

    model = frame.get("camera_model", "OPENCV")
    if model not in PINHOLES:
        raise InvalidInput(f"{within}camera_model", f"expected one of {', '.join(PINHOLES)}, found {model!r}; undistort the images")
    height, width = size
    calibrated = given("w") if "w" in frame else width
    if calibrated <= 0:
        raise InvalidInput(f"{within}w", f"expected a width in pixels, found {calibrated:g}")
    scale = width / calibrated
    if "fl_x" in frame:
        fx = scale * given("fl_x")
    elif "camera_angle_x" in frame:
        fx = width / 2 / np.tan(given("camera_angle_x") / 2)
    else:
        raise InvalidInput(f"{within}fl_x", "is missing; expected a focal length in pixels, or camera_angle_x in radians")
    fy = scale * given("fl_y") if "fl_y" in frame else fx
    cx = scale * given("cx") if "cx" in frame else width / 2
    cy = scale * given("cy") if "cy" in frame else height / 2
    K = np.array([[fx, 0, cx - 0.5], [0, fy, cy - 0.5], [0, 0, 1]])
    return K, tuple(given(name) if name in frame else 0.0 for name in DISTORTION)


def _depth_name(frame: Mapping[str, Any], within: str) -> str | None:
    return _file_name(frame, "depth_file_path", within) or _file_name(frame, "depth_path", within)


def _file_name(frame: Mapping[str, Any], field: str, within: str) -> str | None:
    name = frame.get(field)
    if name is not None and not isinstance(name, str):
        raise InvalidInput(f"{within}{field}", f"expected the name of a file, found {name!r:.80}")
    return name


def _depth(folder: Path, frame: Mapping[str, Any], size: tuple[int, int], within: str) -> NDArray[np.float32] | None:
    """In the image's size (H, W): nerfstudio's `depth_file_path`, or Instant-NGP's `depth_path` with `integer_depth_scale`."""
    name = _depth_name(frame, within)
    if name is None:
        return None
    unit = "depth_unit_scale_factor" if "depth_file_path" in frame else "integer_depth_scale"
    if unit in frame:
        unit_m = float(folders.read_numbers(frame, unit, (), within))
    elif unit == "depth_unit_scale_factor":
        unit_m = MILLIMETRES
    else:
        raise InvalidInput(f"{within}{unit}", f"is missing beside depth_path {name}; expected metres a unit of the depth images")
    path = folder / name
    depth_m = ((_array(path) if path.suffix == ".npy" else read_units(path)) * unit_m).astype(np.float32)
    resized = cv2.resize(np.nan_to_num(depth_m, posinf=0, neginf=0), size[::-1], interpolation=cv2.INTER_NEAREST_EXACT)
    return np.asarray(resized) if resized.any() else None


def _array(path: Path) -> NDArray[Any]:
    try:
        return np.asarray(np.load(path, allow_pickle=False), dtype=float)
    except (OSError, TypeError, ValueError) as error:
        raise InvalidInput(str(path), f"cannot be read as numpy's array of depth ({error})") from None


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
