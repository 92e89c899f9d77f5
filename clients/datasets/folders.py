"""Recorded objects, and the data layout: one folder a sequence, CATEGORY/INSTANCE/{rgb,depth,mask_visib,scene_*.json,sequence.json}.

Other data sets are read by the modules beside this one, each a `Format` that it offers by its prefix, `OFFERS: Mapping[str, Format] =
{"prefix": find_sequences}`; `sources.find_sequences` opens any of them, and docs/data.md lists them.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterator, Mapping
from collections.abc import Sequence as Indices
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from clients.datasets.images import is_image, read_depth, read_mask, read_rgb
from core.errors import InvalidInput
from core.sim3 import Sim3
from core.views import Burst, Camera, FloatArray, View, require_rotation

ABOUT = "sequence.json"
"""The file that makes a folder a sequence."""
CAMERAS = "scene_camera.json"
TRUTH = "scene_gt.json"
SYMMETRY_SIDES = {9: 3, 16: 4}
"""Rows of a symmetry's matrix, by how many numbers it has."""


class Reader(Protocol):
    """How the views of a sequence are read, and all that they depend on: an encoding that a benchmark keeps is found again by it."""

    def read(self, sequence: Sequence, indices: Indices[int], masks: bool) -> list[View]:
        """The views at `indices`; silhouettes where `masks` asks for them and the data have them."""
        ...

    def files(self, sequence: Sequence) -> list[Path]:
        """Every file, below the sequence's folder, that its views are read from."""
        ...

    def cameras(self, sequence: Sequence) -> str:
        """What else decides on the views, and is in none of these files."""
        return ""


class LayoutReader(Reader):
    """Reads the data layout."""

    def read(self, sequence: Sequence, indices: Indices[int], masks: bool) -> list[View]:
        """See `Reader`."""
        cameras = read_json(sequence.path / CAMERAS)
        return [_load_view(sequence, sequence.images[index], cameras, masks) for index in indices]

    def files(self, sequence: Sequence) -> list[Path]:
        """See `Reader`."""
        return [*sequence.images, *sorted((sequence.path / "depth").glob("*.png")), sequence.path / CAMERAS]


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
    reader: Reader = LayoutReader()
    longest_side_m: float | None = None
    """Of the object's box, where the data tell: the unit of the paper's translation figures."""

    @property
    def name(self) -> str:
        """`category/instance`."""
        return f"{self.category}/{self.instance}"

    @property
    def key(self) -> str:
        """Tells it from every other one: one folder may hold several, and two data sets one name."""
        return f"{self.path}:{self.name}"


Format = Callable[[Path], list[Sequence]]
"""Every sequence below a folder. Raises InvalidInput, saying what was expected, where there is none."""


def find_sequences(root: Path) -> list[Sequence]:
    """Every sequence below `root`, links followed, sorted by path. Raises InvalidInput where there is none."""
    folders = sorted(folder for folder, files in folders_below(root) if ABOUT in files)
    if not folders:
        other = f"or another layout by its prefix, such as transforms:{root} where it holds a transforms.json"
        raise InvalidInput("data", f"no {ABOUT} below {root}; expected CATEGORY/INSTANCE/{ABOUT}, {other}")
    return [_read_sequence(folder) for folder in folders]


def by_category(sequences: Indices[Sequence]) -> dict[str, list[Sequence]]:
    """Sequences of each category, categories and instances sorted by name."""
    grouped: dict[str, list[Sequence]] = {}
    for sequence in sorted(sequences, key=lambda sequence: (sequence.category, sequence.instance)):
        grouped.setdefault(sequence.category, []).append(sequence)
    return grouped


def load_burst(sequence: Sequence, indices: Indices[int] | None = None, *, masks: bool = False) -> Burst:
    """The views of `sequence` at `indices` (all where left out); silhouettes only where `masks` asks for them."""
    chosen = range(len(sequence.images)) if indices is None else indices
    return Burst(sequence.reader.read(sequence, chosen, masks))


def folders_below(root: Path) -> Iterator[tuple[Path, list[str]]]:
    """`root` and every folder below it with the names of its files; each once, however many links lead to it: one may even lead back up."""
    seen: set[Path] = set()
    for folder, inner, files in os.walk(root, followlinks=True):
        inner.sort()
        resolved = Path(folder).resolve()
        if resolved in seen:
            inner.clear()
            continue
        seen.add(resolved)
        yield Path(folder), files


def _load_view(sequence: Sequence, image: Path, cameras: dict[str, Any], masks: bool) -> View:
    rgb = read_rgb(image)
    mask_file = sequence.path / "mask_visib" / f"{image.stem}_000000.png"
    mask = read_mask(mask_file) if masks and mask_file.exists() else None
    key = key_of(image) if cameras else ""
    entry = cameras.get(key)
    if entry is None or (isinstance(entry, Mapping) and "cam_R_w2c" not in entry):
        return view_of(image, rgb, mask=mask)
    within = f"{sequence.path / CAMERAS}: {key}."
    depth_file = sequence.path / "depth" / f"{image.stem}.png"
    depth_m = None
    if depth_file.exists():
        depth_m = read_depth(depth_file, float(read_numbers(entry, "depth_scale", (), within)) / 1000)
    return view_of(image, rgb, depth_m, read_camera(entry, within), mask)


def view_of(
    image: Path,
    rgb: NDArray[np.uint8],
    depth_m: NDArray[np.float32] | None = None,
    camera: Camera | None = None,
    mask: NDArray[np.bool_] | None = None,
) -> View:
    """The view of an image file. Raises InvalidInput, naming that file, where its parts do not go together."""
    try:
        return View(rgb, depth_m, camera, mask)
    except InvalidInput as error:
        raise InvalidInput(f"{image}: {error.field.removeprefix('view.')}", error.message) from None


def key_of(image: Path) -> str:
    """What an image is called by in the scene's files. Raises InvalidInput where its name is no number."""
    if not (image.stem.isascii() and image.stem.isdecimal()):
        raise InvalidInput(str(image), f"expected a number for a name, such as 000000{image.suffix}: by it {CAMERAS} tells its camera")
    return str(int(image.stem))


def read_camera(entry: Mapping[str, Any], within: str) -> Camera:
    """From an entry of BOP's scene_camera.json that has a pose. Raises as `read_numbers` does."""
    rotation = read_numbers(entry, "cam_R_w2c", (3, 3), within)
    world_from_camera = np.eye(4)
    world_from_camera[:3, :3] = rotation.T
    world_from_camera[:3, 3] = -rotation.T @ read_numbers(entry, "cam_t_w2c", (3,), within) / 1000
    return camera_of(read_numbers(entry, "cam_K", (3, 3), within), world_from_camera, within)


def camera_of(K: FloatArray, world_from_camera: FloatArray, within: str) -> Camera:
    """Of shapes (3, 3) and (4, 4). Raises InvalidInput, naming it after `within`, where it is none."""
    try:
        return Camera(K, world_from_camera)
    except InvalidInput as error:
        raise InvalidInput(f"{within}{error.field}", error.message) from None


def read_numbers(entry: Mapping[str, Any], name: str, shape: tuple[int, ...], within: str) -> FloatArray:
    """An entry's numbers, row by row, as an array of `shape`. Raises InvalidInput naming them after `within`, such as `FILE: 7.`."""
    try:
        numbers = np.array(entry[name], dtype=float).reshape(shape)
        if not np.isfinite(numbers).all():  # null, too
            raise ValueError
        return numbers
    except (KeyError, TypeError, ValueError):
        count = math.prod(shape)
        expected = f"{count} numbers, row by row" if count > 1 else "a number"
        found = entry.get(name) if isinstance(entry, Mapping) else entry
        raise InvalidInput(f"{within}{name}", f"expected {expected}, found {found!r:.80}") from None


def read_list(entry: Mapping[str, Any], name: str, within: str) -> list[Any]:
    """An entry's list, empty where there is none. Raises as `read_numbers` does."""
    found = entry.get(name) or []
    if not isinstance(found, list):
        raise InvalidInput(f"{within}{name}", f"expected a list, found {found!r:.80}")
    return found


def _read_sequence(folder: Path) -> Sequence:
    about = read_json(folder / ABOUT)
    for name in ("category", "instance"):
        if not isinstance(about.get(name), str):
            raise InvalidInput(f"{folder / ABOUT}: {name}", f"expected a name, found {about.get(name)!r:.80}")
    images = tuple(sorted(path for path in (folder / "rgb").glob("*") if is_image(path)))
    if not images:
        raise InvalidInput(str(folder), f"has no folder rgb with images in it; expected it beside {ABOUT}")
    listed = enumerate(read_list(about, "symmetries", f"{folder / ABOUT}: "))
    symmetries = tuple(read_symmetry(matrix, f"{folder / ABOUT}: symmetries[{index}]") for index, matrix in listed)
    longest_mm = read_numbers(about, "longest_side_mm", (), f"{folder / ABOUT}: ") if about.get("longest_side_mm") else None
    return Sequence(
        folder,
        about["category"],
        about["instance"],
        images,
        _world_from_model(folder, about),
        symmetries,
        longest_side_m=None if longest_mm is None else float(longest_mm) / 1000,
    )


def read_symmetry(matrix: Any, field: str) -> FloatArray:
    """A rotation, shape (3, 3), from 3×3 numbers, or from the 4×4 of BOP's `symmetries_discrete`; nested or row by row."""
    try:
        numbers = np.array(matrix, dtype=float).ravel()
    except (TypeError, ValueError):  # rows of unequal length, or no numbers
        numbers = np.empty(0)
    if numbers.size not in SYMMETRY_SIDES or not np.isfinite(numbers).all():
        raise InvalidInput(field, f"expected a rotation as 9 numbers (3×3) or a transform as 16 (4×4), row by row, found {matrix!r:.80}")
    side = SYMMETRY_SIDES[numbers.size]
    rotation = numbers.reshape(side, side)[:3, :3]
    require_rotation(rotation, field)
    return rotation


def _world_from_model(folder: Path, about: dict[str, Any]) -> Sim3 | None:
    truth, cameras = read_json(folder / TRUTH), read_json(folder / CAMERAS)
    first = next((key for key in truth if truth[key] and key in cameras), None)
    if first is None:
        return None
    pose, within = read_list(truth, first, f"{folder / TRUTH}: ")[0], f"{folder / TRUTH}: {first}[0]."
    camera = read_camera(cameras[first], f"{folder / CAMERAS}: {first}.")
    camera_from_model = Sim3(
        float(read_numbers(about, "model_scale_mm", (), f"{folder / ABOUT}: ")) / 1000,
        read_numbers(pose, "cam_R_m2c", (3, 3), within),
        read_numbers(pose, "cam_t_m2c", (3,), within) / 1000,
    )
    return Sim3(1.0, camera.world_from_camera[:3, :3], camera.world_from_camera[:3, 3]) @ camera_from_model


def read_json(path: Path) -> dict[str, Any]:
    """A JSON object; empty where there is no file. Raises InvalidInput where it is none."""
    if not path.exists():
        return {}
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise InvalidInput(str(path), f"is not JSON ({error})") from None
    if not isinstance(found, dict):
        raise InvalidInput(str(path), f"expected a JSON object, found {found!r:.80}")
    return found
