"""Worse pictures: movement, wrong exposure, compression, few pixels. Blur and exposure are computed on light, not on sRGB's values.

Letters: K a kernel's side in pixels.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from core.views import Camera, FloatArray, View

FULL_WELL = 10_000
"""Electrons that a pixel holds, the light that is white: those of small sensors."""
READ_NOISE = 10
"""Electrons."""
STEPS = 8
"""Points a pixel along the path of a moving camera."""


def motion_blur(view: View, strength: float, rng: np.random.Generator) -> View:
    """The picture smeared along a line, as long as `strength` percent of its width, in a random direction; depth stays."""
    kernel = line_kernel(strength / 100 * view.size[1], rng.uniform(0, np.pi))
    blurred = cv2.filter2D(to_light(view.rgb), -1, kernel, borderType=cv2.BORDER_REPLICATE)
    return replace(view, rgb=from_light(np.asarray(blurred)))


def line_kernel(length_px: float, angle: float) -> FloatArray:
    """A line of this length through the middle, at an angle in radians, that sums to 1, shape (K, K)."""
    reach = int(np.ceil(length_px / 2)) + 1
    path = np.linspace(-length_px / 2, length_px / 2, max(2, int(STEPS * length_px)))
    x, y = path * np.cos(angle) + reach, path * np.sin(angle) + reach
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    right, below = x - column, y - row
    kernel = np.zeros((2 * reach + 1, 2 * reach + 1))
    for down, across in ((0, 0), (0, 1), (1, 0), (1, 1)):
        weight = (below if down else 1 - below) * (right if across else 1 - right)
        np.add.at(kernel, (row + down, column + across), weight)
    return kernel / kernel.sum()


def underexposure(view: View, strength: float, rng: np.random.Generator) -> View:
    """`strength` stops less light, with the sensor's noise."""
    return _exposed(view, -strength, rng)


def overexposure(view: View, strength: float, rng: np.random.Generator) -> View:
    """`strength` stops more light: what is too bright becomes white."""
    return _exposed(view, strength, rng)


def jpeg(view: View, strength: float, rng: np.random.Generator) -> View:
    """Compressed with quality `strength`."""
    encoded = cv2.imencode(".jpg", view.rgb[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, int(strength)])[1]
    decoded = cv2.imdecode(encoded, cv2.IMREAD_COLOR)
    assert decoded is not None, "it was encoded the line before"
    return replace(view, rgb=np.ascontiguousarray(decoded[..., ::-1], dtype=np.uint8))


def resolution(view: View, strength: float, rng: np.random.Generator) -> View:
    """A camera of `strength` times fewer pixels a side: picture, depth and intrinsics."""
    factor = 1 / strength
    height, width = (round(factor * side) for side in view.size)
    camera, depth_m, mask = view.camera, view.depth_m, view.mask
    if camera is not None:
        K = camera.K.copy()
        K[:2] *= factor
        K[:2, 2] += (factor - 1) / 2  # pixel centres are at integers
        camera = Camera(K, camera.world_from_camera)
    if depth_m is not None:
        depth_m = np.asarray(cv2.resize(depth_m, (width, height), interpolation=cv2.INTER_NEAREST_EXACT), dtype=np.float32)
    if mask is not None:
        mask = cv2.resize(mask.astype(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST_EXACT) > 0
    rgb = np.asarray(cv2.resize(view.rgb, (width, height), interpolation=cv2.INTER_AREA), dtype=np.uint8)
    return View(rgb, depth_m, camera, mask)


def to_light(rgb: NDArray[np.uint8]) -> FloatArray:
    """Shares of white's light, of sRGB values, both of any shape."""
    value = rgb / 255
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def from_light(light: FloatArray) -> NDArray[np.uint8]:
    """The inverse of `to_light`, of any shape; beyond black and white it is clipped."""
    light = light.clip(0, 1)
    value = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return np.round(255 * value).astype(np.uint8)


def _exposed(view: View, stops: float, rng: np.random.Generator) -> View:
    electrons = FULL_WELL * 2.0**stops * to_light(view.rgb)
    noise = np.sqrt(electrons + READ_NOISE**2) * rng.standard_normal(electrons.shape)
    return replace(view, rgb=from_light((electrons + noise) / FULL_WELL))
