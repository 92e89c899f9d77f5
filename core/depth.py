"""Depth: fast completion for pictures, and the honest validity map for geometry.

Letters: H, W image height and width; G cells a side.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from core.views import FloatArray

DIAMOND_5 = np.array([[0, 0, 1, 0, 0], [0, 1, 1, 1, 0], [1, 1, 1, 1, 1], [0, 1, 1, 1, 0], [0, 0, 1, 0, 0]], dtype=np.uint8)
LARGE_KERNEL = 31
"""The appendix's "very large" dilation, pixels."""
FLYING_RATIO = 0.04
"""A depth step of this share of the depth within 3×3 pixels is a silhouette: objects seen from a few diagonals away
slope by under 2 % a pixel pair even at grazing angles."""
SAMPLES = 8
"""Depth samples a cell side."""


def complete(depth_m: NDArray[np.float32]) -> NDArray[np.float32]:
    """`depth_m`, shape (H, W), without holes (0 = missing): for display and crops, never for geometry.

    The kernel sequence of Ku et al. 2018 with the appendix's last steps ("Fast depth completion"): diamond dilation,
    closing, small fill, large dilation, then the mean for what is still empty. Nearer surfaces win, as in Ku et al.
    """
    measured = depth_m > 0
    if not measured.any():
        return depth_m.copy()
    top = float(depth_m.max()) + 1.0
    inverted: FloatArray = np.where(measured, top - depth_m, 0).astype(np.float32)
    inverted = np.asarray(cv2.dilate(inverted, DIAMOND_5))
    inverted = np.asarray(cv2.morphologyEx(inverted, cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8)))
    for size in (7, LARGE_KERNEL):
        inverted = np.where(inverted > 0, inverted, cv2.dilate(inverted, np.ones((size, size), np.uint8)))
    inverted = np.asarray(cv2.medianBlur(inverted, 5))
    filled = np.where(inverted > 0, top - inverted, float(depth_m[measured].mean()))
    return np.where(measured, depth_m, filled).astype(np.float32)


def reliable(depth_m: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Where depth was measured and is no flying pixel between two surfaces, shape (H, W)."""
    measured = depth_m > 0
    kernel = np.ones((3, 3), np.uint8)
    farthest = cv2.dilate(depth_m, kernel)
    nearest = cv2.erode(np.where(measured, depth_m, np.inf).astype(np.float32), kernel)
    return np.asarray(measured & (farthest - nearest < FLYING_RATIO * depth_m))


def cell_depth(depth_m: FloatArray, use: NDArray[np.bool_], grid: int) -> FloatArray:
    """Median depth of the usable samples of each cell, shape (G, G); NaN where a cell has none.

    Args:
        depth_m, use: shape (G·SAMPLES, G·SAMPLES), the crop resampled without interpolation.
    """
    values = np.where(use, depth_m, np.nan).reshape(grid, SAMPLES, grid, SAMPLES).swapaxes(1, 2).reshape(grid, grid, -1)
    ordered = np.sort(values, axis=-1)  # NaN sorts last
    count = np.isfinite(ordered).sum(axis=-1)
    middle = np.maximum(count - 1, 0) // 2
    return np.take_along_axis(ordered, middle[..., None], axis=-1)[..., 0]
