"""Worse places: something before the object, or other things around it. The view's mask says where the object is.

Letters: H, W image height and width in pixels; N pixels of the object.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.degradations.noise import texture
from core.errors import InvalidInput
from core.views import FloatArray, View

BEFORE = 0.9
"""An occluder's depth, as a share of the object's nearest point's."""
ASPECT = (0.5, 2.0)
"""Sides of an occluder."""
SIZES = (0.6, 1.0)
"""Of the things around, as shares of the object's larger side in the picture."""
OVERLAP = 0.9
"""Distance of their middles to the object's, as a share of what would make the two boxes touch."""


def occlusion(view: View, strength: float, rng: np.random.Generator) -> View:
    """A textured board over the share `strength` of the object, from its edge inwards, nearer to the camera than all of it."""
    silhouette = _silhouette(view)
    pixels = np.argwhere(silhouette)  # (N, 2)
    inside = cv2.erode(silhouette.astype(np.uint8), np.ones((3, 3), np.uint8), borderValue=0) > 0
    middle = rng.choice(np.argwhere(silhouette & ~inside))
    angle, aspect = rng.uniform(0, np.pi), rng.uniform(*ASPECT)
    size = np.quantile(_board_distance(pixels - middle, angle, aspect), strength)
    everywhere = np.indices(view.size).transpose(1, 2, 0)
    board = _board_distance(everywhere - middle, angle, aspect) <= size
    depth_m = view.depth_m
    if depth_m is not None:
        on_object = depth_m[silhouette & (depth_m > 0)]
        nearest_m = float(np.quantile(on_object, 0.01)) if len(on_object) else float(depth_m.max())
        depth_m = np.where(board, np.float32(BEFORE * nearest_m), depth_m)
    rgb = np.where(board[..., None], texture(view.size, rng), view.rgb)
    left = silhouette & ~board
    return View(rgb, depth_m, view.camera, left if left.any() else None)


def clutter(view: View, strength: float, rng: np.random.Generator, things: Sequence[View]) -> View:
    """`strength` other things around the object, as far away as it and about as large, none of it hidden.

    Args:
        things: views with masks, whose objects are cut out.
    """
    silhouette = _silhouette(view)
    for place, thing in enumerate(rng.permutation(len(things))[np.arange(int(strength)) % len(things)]):
        angle = 2 * np.pi * (place * GOLDEN + rng.uniform(0, 0.1))
        view = _paste(view, silhouette, _cut_out(things[thing]), angle, rng.uniform(*SIZES))
    return view


GOLDEN = (np.sqrt(5) - 1) / 2
"""Steps of this share of a turn leave no side empty, however many things there are."""


@dataclass(frozen=True, eq=False)
class CutOut:
    """A thing without its place."""

    rgb: NDArray[np.uint8]
    """Shape (H, W, 3)."""
    shown: NDArray[np.bool_]
    """Shape (H, W)."""
    relief: FloatArray | None
    """Depth over the thing's median depth, shape (H, W); 0 where nothing was measured."""


def _cut_out(view: View) -> CutOut:
    silhouette = _silhouette(view)
    top, left, height, width = _box(silhouette)
    part = slice(top, top + height), slice(left, left + width)
    relief = None
    if view.depth_m is not None:
        measured = view.depth_m[silhouette & (view.depth_m > 0)]
        relief = view.depth_m[part] / (np.median(measured) if len(measured) else 1.0)
    return CutOut(view.rgb[part], silhouette[part], relief)


def _paste(view: View, silhouette: NDArray[np.bool_], thing: CutOut, angle: float, size: float) -> View:
    """`size` of the object's larger side large, in direction `angle` of its middle, behind all of it."""
    top, left, height, width = _box(silhouette)
    factor = size * max(height, width) / max(thing.shown.shape)
    side = tuple(max(1, round(factor * each)) for each in thing.shown.shape)
    apart = OVERLAP * (np.array([height, width]) + side) / 2
    center = np.array([top + height / 2, left + width / 2]) + apart * [np.sin(angle), np.cos(angle)]
    corner = np.round(center - np.array(side) / 2).astype(int)
    begin, end = np.maximum(corner, 0), np.minimum(corner + side, view.size)
    if (begin >= end).any():
        return view  # all of it is outside the picture
    there = slice(begin[0], end[0]), slice(begin[1], end[1])
    part = tuple(slice(low, high) for low, high in zip(begin - corner, end - corner))
    shown = _resized(thing.shown.astype(np.uint8), side)[part] > 0
    shown &= ~silhouette[there]
    rgb = view.rgb.copy()
    rgb[there][shown] = _resized(thing.rgb, side)[part][shown]
    depth_m = view.depth_m
    if depth_m is not None and thing.relief is not None:
        measured = depth_m[silhouette & (depth_m > 0)]
        depth_m = depth_m.copy()
        depth_m[there][shown] = (_resized(thing.relief, side)[part] * (np.median(measured) if len(measured) else 0))[shown]
    return replace(view, rgb=rgb, depth_m=depth_m)


def _resized(image: NDArray[Any], side: tuple[int, ...]) -> NDArray[Any]:
    return np.asarray(cv2.resize(image, side[::-1], interpolation=cv2.INTER_NEAREST_EXACT))


def _board_distance(offsets: NDArray[Any], angle: float, aspect: float) -> FloatArray:
    """How large a board must be to reach these (row, column) offsets from its middle, shape (*) from (*, 2)."""
    along = offsets @ np.array([np.sin(angle), np.cos(angle)])
    across = offsets @ np.array([np.cos(angle), -np.sin(angle)])
    return np.maximum(np.abs(along), np.abs(across) * aspect)


def _box(mask: NDArray[np.bool_]) -> tuple[int, int, int, int]:
    """(top, left, height, width)."""
    left, top, width, height = cv2.boundingRect(mask.astype(np.uint8))
    return top, left, height, width


def _silhouette(view: View) -> NDArray[np.bool_]:
    if view.mask is None:
        raise InvalidInput("view.mask", "is missing: it says where the object is that something hides or stands beside")
    return view.mask
