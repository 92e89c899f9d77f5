"""Small copies of a data folder, in the same layout: what the demo and the tests run on."""

from __future__ import annotations

import json
import random
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from clients.datasets.folders import ABOUT, CAMERAS, TRUTH, Sequence, by_category, find_sequences, load_burst, read_json
from clients.datasets.images import write_image
from clients.datasets.viewpoints import spread
from core.errors import InvalidInput
from core.views import View

PNG_OPTIONS = [cv2.IMWRITE_PNG_COMPRESSION, 9, cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FILTER_UP]
"""Found smallest on depth images."""


@dataclass(frozen=True)
class ShrinkConfig:
    """How much is kept."""

    categories: int = 5
    instances: int = 3
    """Objects of each category."""
    views: int = 12
    side: int = 320
    """Longer side of the images, pixels."""
    jpeg_quality: int = 80
    depth_step: float = 0.004
    """Depth's quantisation as a fraction of its median: well under the noise of a stereo camera, and what makes the files small."""
    masks: int = 1
    """Views of each object that keep their silhouette, for tests."""


def shrink(data: Path, out: Path, config: ShrinkConfig, *, seed: int = 0) -> list[str]:
    """Writes small copies of objects of `data` below `out`; returns their names.

    Objects are drawn by `seed` alone: nothing about how well a method does on them enters.
    """
    if out.exists() and any(out.iterdir()):
        raise InvalidInput("out", f"{out} is not empty; name a new folder")
    chosen = draw(find_sequences(data), config, random.Random(seed))
    for sequence in chosen:
        _shrink_sequence(sequence, out / sequence.category / sequence.instance, config)
    return [sequence.name for sequence in chosen]


def draw(sequences: list[Sequence], config: ShrinkConfig, order: random.Random) -> list[Sequence]:
    """`instances` objects of each of `categories` categories that have as many, sorted by name."""
    groups = by_category(sequences)
    enough = [category for category, members in groups.items() if len(members) >= config.instances]
    if len(enough) < config.categories:
        raise InvalidInput("data", f"{len(enough)} categories have {config.instances} objects or more; {config.categories} are asked for")
    drawn = [order.sample(groups[category], config.instances) for category in order.sample(enough, config.categories)]
    return sorted((member for members in drawn for member in members), key=lambda sequence: sequence.name)


def _shrink_sequence(sequence: Sequence, out: Path, config: ShrinkConfig) -> None:
    burst = load_burst(sequence, masks=True)
    kept = spread(burst.cameras, config.views)
    cameras, truth = (read_json(sequence.path / name) for name in (CAMERAS, TRUTH))
    depth_step_mm = _depth_step_mm([burst.views[index] for index in kept], config)
    small_cameras: dict[str, Any] = {}
    small_truth: dict[str, Any] = {}
    for new, old in enumerate(kept):
        view, key = burst.views[old], str(int(sequence.images[old].stem))
        scale = config.side / max(view.size)
        _write_view(view, scale, out, new, config, depth_step_mm)
        small_cameras[str(new)] = cameras[key] | {"cam_K": _scaled_intrinsics(cameras[key]["cam_K"], scale), "depth_scale": depth_step_mm}
        if key in truth:
            small_truth[str(new)] = truth[key]
    (out / CAMERAS).write_text(json.dumps(small_cameras))
    if small_truth:
        (out / TRUTH).write_text(json.dumps(small_truth))
    shutil.copyfile(sequence.path / ABOUT, out / ABOUT)


def _depth_step_mm(views: list[View], config: ShrinkConfig) -> float:
    """Millimetres a unit; 1 where there is no depth."""
    measured = [view.depth_m[view.depth_m > 0] for view in views if view.depth_m is not None]
    return round(config.depth_step * float(np.median(np.concatenate(measured))) * 1000, 3) if measured else 1.0


def _scaled_intrinsics(intrinsics: list[float], scale: float) -> list[float]:
    """cam_K for images `scale` times as large; pixel centres are at integers, so the image's corner is at −0.5."""
    K = np.array(intrinsics).reshape(3, 3)
    K[:2] *= scale
    K[:2, 2] += (scale - 1) / 2
    return [round(value, 6) for value in K.ravel().tolist()]


def _write_view(view: View, scale: float, out: Path, number: int, config: ShrinkConfig, depth_step_mm: float) -> None:
    size = (round(view.size[1] * scale), round(view.size[0] * scale))
    rgb = cv2.cvtColor(cv2.resize(view.rgb, size, interpolation=cv2.INTER_AREA), cv2.COLOR_RGB2BGR)
    write_image(out / "rgb" / f"{number:06}.jpg", rgb, [cv2.IMWRITE_JPEG_QUALITY, config.jpeg_quality])
    if view.depth_m is not None:
        # Interpolated depth would invent surfaces between the object and its background, so the nearest measurement is taken.
        depth = cv2.resize(view.depth_m, size, interpolation=cv2.INTER_NEAREST_EXACT)
        units = np.round(depth * 1000 / depth_step_mm).astype(np.uint16)
        write_image(out / "depth" / f"{number:06}.png", units, PNG_OPTIONS)
    if view.mask is not None and number < config.masks:
        mask = cv2.resize(view.mask.astype(np.uint8) * 255, size, interpolation=cv2.INTER_NEAREST_EXACT)
        write_image(out / "mask_visib" / f"{number:06}_000000.png", mask, PNG_OPTIONS)
