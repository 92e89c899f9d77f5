"""Encoded views as plain arrays and back: for npz files, never pickled.

    fingerprint        ()         str       the backbone's
    counts             (V,)       int64     foreground patches of each view
    grid               (V,)       int64     patches a side of each view's close crop
    window             (V, 3)     int64     x0, y0 and size of each view's close crop
    cells              (N, 2)     int16     of the patches of all views, one view after the other
    descriptors        (N, D)     float16
    points_m           (N, 3)     float32
    saliency           (V, G, G)  float16
    cls, pooled        (V, D)     float32
    K                  (V, 3, 3)  float     NaN where a view has no camera
    world_from_camera  (V, 4, 4)  float     the same

What each means is said at `core.encode.EncodedView`.

Letters: V views, N foreground patches of all views, D token size, G patches a side.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.crop import Window
from core.encode import EncodedBurst, EncodedView
from core.views import Camera

Arrays = Mapping[str, NDArray[Any]]
NO_CAMERA = np.full((4, 4), np.nan)
"""Stands for the matrices of a view without camera."""


def burst_as_arrays(encoded: EncodedBurst) -> dict[str, NDArray[Any]]:
    """Everything but the timings, by the names above; tokens and saliency in half precision."""
    views = encoded.views
    return {
        "fingerprint": np.array(encoded.fingerprint),
        "counts": np.array([len(view.cells) for view in views]),
        "grid": np.array([view.grid for view in views]),
        "window": np.array([[view.window.x0, view.window.y0, view.window.size] for view in views]),
        "cells": np.concatenate([view.cells for view in views]),
        "descriptors": np.concatenate([view.descriptors for view in views]).astype(np.float16),
        "points_m": np.concatenate([view.points_m for view in views]),
        "saliency": np.stack([view.saliency for view in views]).astype(np.float16),
        "cls": np.stack([view.cls for view in views]),
        "pooled": np.stack([view.pooled for view in views]),
        "K": np.stack([view.camera.K if view.camera else NO_CAMERA[:3, :3] for view in views]),
        "world_from_camera": np.stack([view.camera.world_from_camera if view.camera else NO_CAMERA for view in views]),
    }


def burst_from_arrays(arrays: Arrays) -> EncodedBurst:
    """The inverse of `burst_as_arrays`."""
    arrays = dict(arrays)  # an open npz file reads an array anew at every access
    splits = np.cumsum(arrays["counts"])[:-1]
    cells, points, descriptors = (np.split(arrays[name], splits) for name in ("cells", "points_m", "descriptors"))
    views = tuple(
        EncodedView(
            grid=int(arrays["grid"][index]),
            window=Window(*(int(value) for value in arrays["window"][index])),
            cells=cells[index],
            descriptors=descriptors[index].astype(np.float32),
            points_m=points[index],
            saliency=arrays["saliency"][index].astype(np.float32),
            cls=arrays["cls"][index],
            pooled=arrays["pooled"][index],
            camera=_camera(arrays["K"][index], arrays["world_from_camera"][index]),
        )
        for index in range(len(arrays["counts"]))
    )
    return EncodedBurst(views, str(arrays["fingerprint"]))


def _camera(intrinsics: NDArray[Any], world_from_camera: NDArray[Any]) -> Camera | None:
    return Camera(intrinsics, world_from_camera) if np.isfinite(intrinsics).all() else None
