"""Common Objects in 3D, versions 1 and 2, as published.

DIR/CATEGORY/frame_annotations.jgz, sequence_annotations.jgz and SEQUENCE/{images,depths,depth_masks,masks,pointcloud.ply}; beside them,
for the pose-labelled subset of 20 categories with 10 sequences each, DIR/class_labels/CATEGORY/SEQUENCE.json as its authors publish
them: `trans`, the rigid 4×4 from the world of `reference_seq` to the world of `seq`. Where there are labels, only labelled sequences
are taken.

CO3D's unit of length is its own: an object is about 2π units long. It is taken for a metre here.
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from clients.datasets import folders
from clients.datasets.images import read_mask, read_rgb, read_units
from clients.datasets.ply import read_vertices
from clients.datasets.pytorch3d import camera_from_pytorch3d
from core.errors import InvalidInput
from core.sim3 import Sim3
from core.views import Camera, FloatArray, View

FRAMES = "frame_annotations.jgz"
LABELS = "class_labels"
MAX_VIEWS = 40
"""Of a sequence's hundred frames, evenly spaced: thirty of the reference, and more to choose from."""
FOREGROUND = 128
"""Least value of a mask, 255 times a probability."""
OUTLIERS = 0.01
"""Fraction of a point cloud's points beyond either side of its box, which are taken for noise."""


@dataclass(frozen=True)
class Frame:
    """One annotated image; paths are relative to the data set's folder."""

    image: str
    size: tuple[int, int]
    """(H, W)."""
    viewpoint: Mapping[str, Any]
    depth: Mapping[str, Any] | None
    mask: str | None

    @staticmethod
    def from_json(entry: Mapping[str, Any]) -> Frame:
        """From a frame annotation that has a viewpoint."""
        image, mask = entry["image"], entry.get("mask")
        return Frame(image["path"], tuple(image["size"]), entry["viewpoint"], entry.get("depth"), mask["path"] if mask else None)

    @property
    def camera(self) -> Camera:
        """In the sequence's world."""
        given = self.viewpoint
        form = given.get("intrinsics_format") or "ndc_norm_image_bounds"
        R, T = np.array(given["R"], dtype=float), np.array(given["T"], dtype=float)
        return camera_from_pytorch3d(R, T, given["focal_length"], given["principal_point"], self.size, form)


@dataclass(frozen=True)
class Co3dReader(folders.Reader):
    """Reads the frames of one sequence."""

    root: Path
    frames: tuple[Frame, ...]

    def read(self, sequence: folders.Sequence, indices: Sequence[int], masks: bool) -> list[View]:
        """See `folders.Reader`."""
        return [self._view(self.frames[index], masks) for index in indices]

    def files(self, sequence: folders.Sequence) -> list[Path]:
        """See `folders.Reader`."""
        depths = [frame.depth for frame in self.frames if frame.depth]
        consistent = [depth["mask_path"] for depth in depths if depth.get("mask_path")]
        return [
            self.root / str(name) for name in [*(frame.image for frame in self.frames), *(each["path"] for each in depths), *consistent]
        ]

    def cameras(self, sequence: folders.Sequence) -> str:
        """See `folders.Reader`: the annotations of a whole category are one file."""
        return json.dumps([[frame.viewpoint, frame.depth] for frame in self.frames], sort_keys=True)

    def _view(self, frame: Frame, masks: bool) -> View:
        rgb = read_rgb(self.root / frame.image)
        if rgb.shape[:2] != frame.size:
            raise InvalidInput(str(self.root / frame.image), f"is {rgb.shape[:2]} pixels (H, W); its annotation says {frame.size}")
        mask = read_mask(self.root / frame.mask, FOREGROUND) if masks and frame.mask else None
        return folders.view_of(
            self.root / frame.image, rgb, self._depth(frame), frame.camera, mask if mask is not None and mask.any() else None
        )

    def _depth(self, frame: Frame) -> NDArray[np.float32] | None:
        """In the image's size; None where the frame has none, or where no pixel of it is consistent with other frames."""
        if frame.depth is None:
            return None
        depth = decode_depth(read_units(self.root / frame.depth["path"]), float(frame.depth["scale_adjustment"]))
        consistent = frame.depth.get("mask_path")
        if consistent:
            depth = np.where(read_mask(self.root / consistent), depth, np.float32(0))
        resized = cv2.resize(depth, frame.size[::-1], interpolation=cv2.INTER_NEAREST_EXACT)
        return np.asarray(resized) if resized.any() else None


def decode_depth(units: NDArray[np.uint16], scale_adjustment: float) -> NDArray[np.float32]:
    """Depth from a 16-bit image whose bits are half-precision floats; 0 where they are no number.

    Args:
        units: as stored, shape (H, W).
        scale_adjustment: units of the sequence's world a unit of the floats.
    """
    if units.dtype != np.uint16:
        raise InvalidInput("depth", f"expected a 16-bit image, found {units.dtype}")
    depth = units.view(np.float16).astype(np.float32) * np.float32(scale_adjustment)
    return np.where(np.isfinite(depth) & (depth > 0), depth, np.float32(0))


def find_sequences(root: Path) -> list[folders.Sequence]:
    """Every sequence, or every labelled one where there are labels, by category and name. Raises InvalidInput where there is none."""
    categories = sorted(path.parent for path in root.glob(f"*/{FRAMES}"))
    labelled = (root / LABELS).is_dir()
    sequences = [each for folder in categories for each in _category(root, folder.name, labelled)]
    if not sequences:
        expected = f"labelled in {LABELS}/CATEGORY/SEQUENCE.json" if labelled and categories else f"listed in CATEGORY/{FRAMES}"
        raise InvalidInput("data", f"no sequence below {root} is {expected} and has its images")
    return sequences


def _category(root: Path, category: str, labelled: bool) -> Iterator[folders.Sequence]:
    labels = _read_labels(root / LABELS / category)
    frames: dict[str, list[Frame]] = {}
    for entry in _read_jgz(root / category / FRAMES):
        name = entry["sequence_name"]
        if (name in labels or not labelled) and entry.get("viewpoint") and (root / entry["image"]["path"]).exists():
            frames.setdefault(name, []).append(Frame.from_json(entry))
    for name in sorted(frames):
        kept = _evenly_spaced(sorted(frames[name], key=lambda frame: frame.image))
        folder = root / category / name
        truth = _world_from_model(root / category, labels[name]) if name in labels else None
        cloud = folder / "pointcloud.ply"
        longest = max(extent(read_vertices(cloud))) if truth and cloud.exists() else None
        images = tuple(root / frame.image for frame in kept)
        yield folders.Sequence(folder, category, name, images, truth, (), Co3dReader(root, kept), longest)


def _evenly_spaced(frames: list[Frame]) -> tuple[Frame, ...]:
    chosen = np.linspace(0, len(frames) - 1, min(MAX_VIEWS, len(frames))).round().astype(int)
    return tuple(frames[index] for index in chosen)


def _read_labels(folder: Path) -> dict[str, Mapping[str, Any]]:
    labels = [folders.read_json(path) for path in sorted(folder.glob("*.json"))]
    return {label["seq"]: label for label in labels}


def _world_from_model(category: Path, label: Mapping[str, Any]) -> Sim3 | None:
    """The labels' model frame: the reference sequence's world, with 0 at the middle of its object and that object's diagonal as unit.

    None where the reference sequence has no point cloud. The labels are rigid, so all objects of a category have one scale.
    """
    cloud = category / label["reference_seq"] / "pointcloud.ply"
    if not cloud.exists():
        return None
    points = read_vertices(cloud)
    low, high = np.quantile(points, [OUTLIERS, 1 - OUTLIERS], axis=0)
    reference_from_model = Sim3(float(np.linalg.norm(extent(points))), np.eye(3), (low + high) / 2)
    return Sim3.from_matrix(np.array(label["trans"], dtype=float)) @ reference_from_model


def extent(points: FloatArray) -> FloatArray:
    """Edge lengths, shape (3,), of the box along the principal axes of points, shape (P, 3), without outliers."""
    centred = points - points.mean(axis=0)
    _, axes = np.linalg.eigh(centred.T @ centred)
    low, high = np.quantile(centred @ axes, [OUTLIERS, 1 - OUTLIERS], axis=0)
    return np.asarray(high - low)


def _read_jgz(path: Path) -> list[dict[str, Any]]:
    try:
        with gzip.open(path, "rt", encoding="utf-8") as stream:
            return list(json.load(stream))
    except (OSError, ValueError) as error:
        raise InvalidInput(str(path), f"is not gzipped JSON ({error}); download it again") from None


OFFERS: Mapping[str, folders.Format] = {"co3d": find_sequences}
