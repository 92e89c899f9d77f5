"""The pictures behind a category and an observation, one function a picture; each returns RGB, shape (H, W, 3), uint8.

Letters: H, W picture height and width; P foreground patches of a view; K correspondences.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from core.boxes import BOX_EDGES, OrientedBox
from core.crop import Window
from core.depth import complete
from core.descriptors import PcaBasis
from core.encode import EncodedView
from core.views import Camera, FloatArray, View

Picture = NDArray[np.uint8]
Colour = tuple[int, int, int]
CROP_SIDE = 448
"""Pixels a side of a picture of a close crop: 16 a patch on a grid of 28."""
DIMMED = 0.35
"""Brightness left to what is not the object."""
AXES_RGB: tuple[Colour, ...] = ((235, 64, 52), (72, 199, 86), (66, 120, 255))
"""Of the object frame's x, y and z."""
BOX_RGB: Colour = (255, 200, 0)
OUTLIER_RGB: Colour = (150, 150, 150)
SMOOTHING = 2
"""Lines are drawn at this multiple of the resolution and reduced."""
PERCENTILES = (2, 98)
"""Shown as darkest and brightest."""


@dataclass(frozen=True, eq=False)
class ComponentColours:
    """The first three principal components as red, green and blue, alike in every picture of one category."""

    basis: PcaBasis
    low: FloatArray
    """Shown as 0, shape (3,)."""
    high: FloatArray
    """Shown as 255, shape (3,)."""

    @staticmethod
    def of(basis: PcaBasis, views: Sequence[EncodedView]) -> ComponentColours:
        """Stretched over the tokens of `views`."""
        components = basis.project(np.concatenate([view.descriptors for view in views]), 3)
        low, high = np.percentile(components, PERCENTILES, axis=0)
        return ComponentColours(basis, low, high)

    def paint(self, descriptors: NDArray[np.float32]) -> FloatArray:
        """A colour for each patch in [0, 255], shape (P, 3)."""
        level = (self.basis.project(descriptors, 3) - self.low) / np.maximum(self.high - self.low, 1e-6)
        return np.asarray(np.pad(np.clip(level, 0, 1) * 255, ((0, 0), (0, 3 - level.shape[1]))))


def encode_png(picture: Picture) -> bytes:
    """As a file."""
    return bytes(cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))[1])


def at_most(picture: Picture, side: int) -> Picture:
    """Reduced to so many pixels of the longer side; never enlarged."""
    height, width = picture.shape[:2]
    share = side / max(height, width)
    if share >= 1:
        return picture
    size = (max(1, round(width * share)), max(1, round(height * share)))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def depth_picture(depth_m: NDArray[np.float32]) -> Picture:
    """Near is bright, far is dark; what was not measured is filled in at half brightness."""
    measured = depth_m > 0
    near, far = np.percentile(depth_m[measured], PERCENTILES)
    picture = _colour_map((far - complete(depth_m)) / max(float(far - near), 1e-6))
    picture[~measured] //= 2
    return picture


def foreground_picture(view: View, encoded: EncodedView) -> Picture:
    """The close crop with everything dimmed that is not taken for the object."""
    crop = _crop(view, encoded.window)
    return _blend(crop, _dimmed(crop), _object_weight(encoded))


def mask_picture(view: View, encoded: EncodedView) -> Picture:
    """White where the view is taken for the object, black elsewhere; as fine as the patches."""
    inside = encoded.window.paste((_object_weight(encoded) > 0.5).astype(np.float32), view.size) > 0.5
    return np.repeat(np.where(inside, 255, 0).astype(np.uint8)[..., None], 3, axis=2)


def saliency_picture(encoded: EncodedView) -> Picture:
    """The soft foreground of the close crop, dark to bright."""
    return _colour_map(np.clip(_enlarged(encoded.saliency.astype(np.float32), cv2.INTER_CUBIC), 0, 1))


def pca_picture(view: View, encoded: EncodedView, colours: ComponentColours) -> Picture:
    """The object's patches coloured by their principal components, over the dimmed close crop."""
    grid = np.zeros((encoded.grid, encoded.grid, 3), dtype=np.float32)
    grid[tuple(encoded.cells.T)] = colours.paint(encoded.descriptors)
    on_object = np.zeros((encoded.grid, encoded.grid), dtype=np.float32)
    on_object[tuple(encoded.cells.T)] = 1
    enlarged, weight = (_enlarged(each, cv2.INTER_NEAREST) for each in (grid, on_object))
    return _blend(enlarged, _dimmed(_crop(view, encoded.window)), weight)


def overlay_picture(view: View, camera: Camera, box: OrientedBox) -> Picture:
    """The view with an oriented box over it; hidden edges are thin, the object's axes start at the box's middle."""
    height, width = view.size
    enlarged = cv2.resize(view.rgb, (width * SMOOTHING, height * SMOOTHING), interpolation=cv2.INTER_CUBIC)
    large = np.asarray(enlarged, dtype=np.uint8)
    thick = max(2, round(min(height, width) / 160)) * SMOOTHING
    corners = box.corners()
    _, corner_depths = camera.project(corners)
    farthest = int(corner_depths.argmax())
    for edge in sorted(BOX_EDGES, key=lambda edge: farthest not in edge):
        _line(large, camera, corners[list(edge)], BOX_RGB, thick // 2 if farthest in edge else thick)
    middle = box.world_from_object[:3, 3]
    for axis, colour in enumerate(AXES_RGB):
        tip = middle + box.world_from_object[:3, axis] * box.extent_m[axis] / 2
        _line(large, camera, np.stack([middle, tip]), colour, thick)
    return _reduced(large)


def correspondence_picture(
    reference: tuple[View, EncodedView],
    target: tuple[View, EncodedView],
    patches: tuple[NDArray[np.integer], NDArray[np.integer]],
    similarity: FloatArray,
    inlier: NDArray[np.bool_],
) -> Picture:
    """The close crops of a reference view (left) and a burst's view (right), lines between corresponding patches.

    Args:
        patches: index into each side's `cells`, shapes (K,).
        similarity: shape (K,); inliers are coloured by it, the most similar brightest.
        inlier: shape (K,); the others are grey.
    """
    gap = CROP_SIDE // 28
    canvas = np.full((CROP_SIDE * SMOOTHING, (2 * CROP_SIDE + gap) * SMOOTHING, 3), 255, dtype=np.uint8)
    ends = []
    for left, (view, encoded), patch in zip((0, CROP_SIDE + gap), (reference, target), patches):
        crop = cv2.resize(_crop(view, encoded.window), None, fx=SMOOTHING, fy=SMOOTHING, interpolation=cv2.INTER_CUBIC)
        canvas[:, left * SMOOTHING : left * SMOOTHING + crop.shape[1]] = crop
        centres = (encoded.cells[patch][:, ::-1] + 0.5) * CROP_SIDE / encoded.grid + (left, 0)
        ends.append(np.round(centres * SMOOTHING).astype(int))
    low, high = (float(similarity.min()), float(similarity.max())) if len(similarity) else (0.0, 1.0)
    colours = _colour_map((similarity - low) / max(high - low, 1e-6))
    for index in sorted(range(len(similarity)), key=lambda index: (inlier[index], similarity[index])):
        colour = tuple(int(value) for value in colours[index]) if inlier[index] else OUTLIER_RGB
        start, end = (tuple(int(value) for value in side[index]) for side in ends)
        cv2.line(canvas, start, end, colour, SMOOTHING if inlier[index] else SMOOTHING // 2, cv2.LINE_AA)
        for point in (start, end):
            cv2.circle(canvas, point, (3 if inlier[index] else 2) * SMOOTHING, colour, -1, cv2.LINE_AA)
    return _reduced(canvas)


def _crop(view: View, window: Window) -> Picture:
    return np.asarray(window.cut(view.rgb, CROP_SIDE), dtype=np.uint8)


def _dimmed(crop: Picture) -> FloatArray:
    return np.asarray(np.repeat(crop.mean(axis=2, keepdims=True), 3, axis=2) * DIMMED)


def _object_weight(encoded: EncodedView) -> FloatArray:
    """1 on the object's patches, 0 elsewhere, smooth between, shape (CROP_SIDE, CROP_SIDE)."""
    grid = np.zeros((encoded.grid, encoded.grid), dtype=np.float32)
    grid[tuple(encoded.cells.T)] = 1
    return np.clip(_enlarged(grid, cv2.INTER_LINEAR) * 3 - 1, 0, 1)


def _enlarged(grid: NDArray[np.float32], interpolation: int) -> FloatArray:
    return np.asarray(cv2.resize(grid, (CROP_SIDE, CROP_SIDE), interpolation=interpolation), dtype=np.float32)


def _blend(over: FloatArray | Picture, under: FloatArray, weight: FloatArray) -> Picture:
    return np.asarray(np.clip(weight[..., None] * over + (1 - weight[..., None]) * under, 0, 255), dtype=np.uint8)


def _colour_map(level: FloatArray) -> Picture:
    """Levels in [0, 1] of any shape as colours, shape (*, 3)."""
    grey = np.round(np.clip(level, 0, 1) * 255).astype(np.uint8)
    mapped = cv2.cvtColor(cv2.applyColorMap(grey.reshape(-1, 1), cv2.COLORMAP_VIRIDIS), cv2.COLOR_BGR2RGB)
    return np.asarray(mapped.reshape(*level.shape, 3), dtype=np.uint8)


def _line(large: NDArray[np.uint8], camera: Camera, ends: FloatArray, colour: Colour, thick: int) -> None:
    """A segment of the world, shape (2, 3); left out where an end is behind the camera or far outside the picture."""
    pixels, depths = camera.project(ends)
    if (depths <= 0).any() or np.abs(pixels).max() > 10 * max(large.shape):
        return
    start, end = (tuple(int(value) for value in np.round((pixel + 0.5) * SMOOTHING - 0.5)) for pixel in pixels)
    cv2.line(large, start, end, colour, thick, cv2.LINE_AA)


def _reduced(large: NDArray[np.uint8]) -> Picture:
    smaller = cv2.resize(large, None, fx=1 / SMOOTHING, fy=1 / SMOOTHING, interpolation=cv2.INTER_AREA)
    return np.asarray(smaller, dtype=np.uint8)
