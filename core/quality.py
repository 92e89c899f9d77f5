"""Whether a view shows what it was taken for: sharp, whole, and with depth on the object.

Letters: H, W image height and width.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from core.encode import EncodedView
from core.views import Camera, FloatArray, View

FaultKind = Literal["out_of_view", "cut_off", "blur", "little_depth", "elsewhere", "copy", "contradicted"]
SIDE = 192
"""Pixels a side that a region is resampled to before its sharpness is judged, so that resolution does not matter."""
LEAST_SHARPNESS = 0.4
"""The sample bursts reach 0.47 to 0.78; blurred by 1 % of the region's side their median is 0.32, moved by 6 % of it 0.31."""
BLUR_WIDTH = 9
"""Pixels of the blur that sharpness is told by (Crete et al. 2007)."""
LEAST_INSIDE = 0.9
"""Share of the region's width and height that the image must hold."""
LEAST_DEPTH = 0.5
"""Share of the region's inner half that must have depth: the region holds background, its middle is the object."""


@dataclass(frozen=True)
class ViewFault:
    """What is wrong with one view; it is used all the same."""

    kind: FaultKind
    detail: str
    """What was found and what would be better."""


@dataclass(frozen=True)
class Region:
    """The square of an image in which the object is, pixels; it may stick out of the image."""

    x: float
    """Of its centre."""
    y: float
    side: float

    def inside(self, size: tuple[int, int], part: float = 1.0) -> tuple[slice, slice]:
        """Rows and columns of the middle `part` of the region that an image of `size` (H, W) holds; both empty where it holds none."""
        half = self.side * part / 2
        (top, bottom), (left, right) = (
            (int(np.clip(round(middle - half), 0, limit)), int(np.clip(round(middle + half), 0, limit)))
            for middle, limit in ((self.y, size[0]), (self.x, size[1]))
        )
        return slice(top, bottom), slice(left, right)


def region_of_sphere(camera: Camera, center_m: FloatArray, diameter_m: float) -> Region | None:
    """Where a camera sees a sphere about a point of the world, shape (3,); None where it is behind the camera."""
    pixel, depth = camera.project(center_m)
    if depth <= 0:
        return None
    return Region(float(pixel[0]), float(pixel[1]), float(diameter_m * max(camera.K[0, 0], camera.K[1, 1]) / depth))


def region_of_mask(mask: NDArray[np.bool_]) -> Region:
    """The square around a silhouette, shape (H, W), that is not empty."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    side = max(np.ptp(rows), np.ptp(columns)) + 1
    return Region(float(columns[0] + columns[-1]) / 2, float(rows[0] + rows[-1]) / 2, float(side))


def region_of_encoded(encoded: EncodedView) -> Region | None:
    """The square around the object that was found in a view; None where none was."""
    if not len(encoded.cells):
        return None
    half_patch = encoded.window.size / encoded.grid / 2
    low, high = encoded.pixels.min(axis=0) - half_patch, encoded.pixels.max(axis=0) + half_patch
    x, y = (low + high) / 2
    return Region(float(x), float(y), float((high - low).max()))


def faults(view: View, region: Region | None) -> tuple[ViewFault, ...]:
    """What is wrong with a view whose object is in `region`, None where it is not in the image; depth is judged where there is some."""
    if region is None or not view.rgb[region.inside(view.size, 0.5)].size:
        return (ViewFault("out_of_view", "the object is not in the image; aim the camera at it"),)
    found = []
    rows, columns = region.inside(view.size)
    held = min(rows.stop - rows.start, columns.stop - columns.start) / region.side
    if held < LEAST_INSIDE:
        found.append(ViewFault("cut_off", f"the image holds {held:.0%} of the object's width or height; step back or aim at its middle"))
    sharp = sharpness(view.rgb[rows, columns])
    if sharp < LEAST_SHARPNESS:
        found.append(ViewFault("blur", f"its sharpness is {sharp:.2f}, at least {LEAST_SHARPNESS} is good; hold still or add light"))
    if view.depth_m is not None:
        measured = float((view.depth_m[region.inside(view.size, 0.5)] > 0).mean())
        if measured < LEAST_DEPTH:
            detail = f"depth was measured on {measured:.0%} of the object; change distance or angle, or avoid glare"
            found.append(ViewFault("little_depth", detail))
    return tuple(found)


def sharpness(rgb: NDArray[np.uint8]) -> float:
    """How much of the detail of an image, shape (H, W, 3), a further blur takes away, in [0, 1] (Crete et al. 2007, "The blur effect").

    A blurred image loses little by another blur. An image without any detail counts as sharp: nothing says that it is not.
    """
    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    smooth = cv2.INTER_AREA if min(grey.shape) > SIDE else cv2.INTER_CUBIC
    detailed = np.asarray(cv2.resize(grey, (SIDE, SIDE), interpolation=smooth), dtype=np.float32)
    shares = []
    for axis, kernel in ((0, (1, BLUR_WIDTH)), (1, (BLUR_WIDTH, 1))):
        before, after = (np.abs(np.diff(image, axis=axis)) for image in (detailed, cv2.blur(detailed, kernel)))
        shares.append(float(np.maximum(before - after, 0).sum() / before.sum()) if before.any() else 1.0)
    return min(shares)
