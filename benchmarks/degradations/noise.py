"""Random fields: smooth noise for sensors, textures for things that never were.

Letters: H, W image height and width in pixels.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from core.views import FloatArray

COARSE, FINE = 4, 24
"""Patches a side of a texture's two layers."""


def smooth_noise(size: tuple[int, int], grain_px: float, rng: np.random.Generator) -> FloatArray:
    """Normal noise of mean 0 and deviation 1, shape (H, W), alike within about `grain_px` pixels."""
    reach = int(np.ceil(3 * grain_px))
    line = np.exp(-0.5 * (np.arange(-reach, reach + 1) / grain_px) ** 2)
    line /= np.linalg.norm(line)  # independent pixels summed with these weights keep their deviation
    white = rng.standard_normal((size[0] + 2 * reach, size[1] + 2 * reach))
    smooth = np.asarray(cv2.sepFilter2D(white, -1, line, line), dtype=float)
    return smooth[reach : reach + size[0], reach : reach + size[1]]


def texture(size: tuple[int, int], rng: np.random.Generator) -> NDArray[np.uint8]:
    """Patches of random colours, large ones under small ones, shape (H, W, 3)."""
    layers = [rng.uniform(0, 255, (patches, patches, 3)) for patches in (COARSE, FINE)]
    large, small = (cv2.resize(each, size[::-1], interpolation=cv2.INTER_NEAREST) for each in layers)
    return (0.6 * large + 0.4 * small).astype(np.uint8)
