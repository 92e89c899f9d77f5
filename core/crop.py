"""Where the object is: a soft foreground map to a close square crop (paper, appendix, "Attention maps for object detection").

Letters: H, W image height and width, S side of a crop or of a map of it, P cells.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from core.views import FloatArray

PADDING_RGB = (124, 116, 104)
"""ImageNet's mean colour, which the backbone sees as zero, outside the image."""


@dataclass(frozen=True)
class Window:
    """A square region of an image, in whole pixels; it may stick out of the image."""

    x0: int
    y0: int
    size: int

    @staticmethod
    def whole(height: int, width: int) -> Window:
        """The smallest centred square that holds the image."""
        size = max(height, width)
        return Window((width - size) // 2, (height - size) // 2, size)

    def to_pixels(self, cells: NDArray[np.integer] | FloatArray, grid: int) -> FloatArray:
        """Image pixels (x, y), shape (P, 2), of the centres of cells (row, column), shape (P, 2), of a grid×grid division."""
        step = self.size / grid
        origin = np.array([self.x0, self.y0])
        return origin + (np.asarray(cells, dtype=float)[:, ::-1] + 0.5) * step - 0.5

    def cut(self, image: NDArray[Any], side: int, *, nearest: bool = False) -> NDArray[Any]:
        """The region of an image, shape (H, W) or (H, W, 3), resampled to (side, side) or (side, side, 3).

        Outside the image colour is the mean colour, everything else 0.
        """
        height, width = image.shape[:2]
        left, top = max(0, -self.x0), max(0, -self.y0)
        right, bottom = max(0, self.x0 + self.size - width), max(0, self.y0 + self.size - height)
        inside = image[max(0, self.y0) : self.y0 + self.size, max(0, self.x0) : self.x0 + self.size]
        fill = PADDING_RGB if image.ndim == 3 else 0
        padded = cv2.copyMakeBorder(inside, top, bottom, left, right, cv2.BORDER_CONSTANT, value=fill)
        smooth = cv2.INTER_AREA if side < self.size else cv2.INTER_CUBIC
        mode = cv2.INTER_NEAREST_EXACT if nearest else smooth
        return cv2.resize(padded, (side, side), interpolation=mode)

    def paste(self, soft: FloatArray, size: tuple[int, int]) -> FloatArray:
        """A map of the region, shape (S, S), resampled onto the image, shape `size`, which is (H, W); 0 outside the region."""
        height, width = size
        across = cv2.resize(soft, (self.size, self.size), interpolation=cv2.INTER_LINEAR)
        image = np.zeros(size, dtype=np.float32)
        top, left = max(0, self.y0), max(0, self.x0)
        bottom, right = min(height, self.y0 + self.size), min(width, self.x0 + self.size)
        image[top:bottom, left:right] = across[top - self.y0 : bottom - self.y0, left - self.x0 : right - self.x0]
        return image


def largest_component(soft: FloatArray, threshold: float) -> NDArray[np.bool_]:
    """The connected component of `soft` > threshold with the largest sum of `soft`, both shape (S, S); all False where nothing exceeds it.

    Ranking by the sum rather than the area keeps a faint strip of background from winning over a small bright object.
    """
    above = (soft > threshold).astype(np.uint8)
    count, labels = cv2.connectedComponents(above, connectivity=8)
    if count < 2:
        return np.zeros(soft.shape, dtype=bool)
    weight = np.bincount(labels.ravel(), weights=soft.ravel(), minlength=count)
    weight[0] = -1
    return np.asarray(labels == int(weight.argmax()))


def close_window(component: NDArray[np.bool_], window: Window, margin: float) -> Window:
    """The square around a component found in the crop of `window`, expanded by `margin` of its longer side in all.

    `component`: shape (S, S), not empty.
    """
    rows, columns = np.flatnonzero(component.any(axis=1)), np.flatnonzero(component.any(axis=0))
    step = window.size / component.shape[0]
    height, width = (rows[-1] + 1 - rows[0]) * step, (columns[-1] + 1 - columns[0]) * step
    size = max(1, round(max(height, width) * (1 + margin)))
    centre_x = window.x0 + (columns[0] + columns[-1] + 1) * step / 2
    centre_y = window.y0 + (rows[0] + rows[-1] + 1) * step / 2
    return Window(round(centre_x - size / 2), round(centre_y - size / 2), size)
