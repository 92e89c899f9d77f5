"""What an observation was decided from, as plain arrays: its pictures, and a scan begun later, need no second encoding.

Letters: V views, P foreground patches of a view, K correspondences, M reference views.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.crop import Window
from core.encode import EncodedBurst, EncodedView
from core.matches import Matches, PoseEstimate
from core.views import Camera

Array = NDArray[Any]
MATCH = "match_"
"""Prefix of the arrays of `Matches`."""


@dataclass(frozen=True, eq=False)
class PoseDetails:
    """What a pose rests on."""

    matches: Matches
    view_similarity: NDArray[np.floating]
    """Of reference view and burst view, shape (M, V)."""
    pairs: tuple[tuple[int, int], ...]
    """(reference view, burst view) pairs whose correspondences were used."""


def features_as_arrays(encoded: EncodedBurst, estimate: PoseEstimate | None) -> dict[str, Array]:
    """Arrays for one npz file; patches of all views are concatenated, tokens kept in half precision."""
    views = encoded.views
    arrays: dict[str, Array] = {
        "fingerprint": np.array(encoded.fingerprint),
        "counts": np.array([len(view.cells) for view in views]),
        "grid": np.array([view.grid for view in views]),
        "window": np.array([[view.window.x0, view.window.y0, view.window.size] for view in views]),
        "cells": np.concatenate([view.cells for view in views]),
        "descriptors": np.concatenate([view.descriptors for view in views]).astype(np.float16),
        "points_m": np.concatenate([view.points_m for view in views]),
        "saliency": np.stack([view.saliency for view in views]).astype(np.float16),
        "cls": encoded.cls,
    }
    if estimate is not None:
        arrays |= {MATCH + field.name: getattr(estimate.matches, field.name) for field in fields(Matches)}
        arrays |= {"view_similarity": estimate.view_similarity, "pairs": np.array(estimate.pairs, dtype=int).reshape(-1, 2)}
    return arrays


def burst_from_arrays(arrays: Mapping[str, Array], cameras: Sequence[Camera | None]) -> EncodedBurst:
    """The encoded burst of `features_as_arrays`; `cameras` are its views', in order."""
    splits = np.cumsum(arrays["counts"])[:-1]
    cells, points, descriptors = (np.split(arrays[name], splits) for name in ("cells", "points_m", "descriptors"))
    views = tuple(
        EncodedView(
            int(arrays["grid"][index]),
            Window(*(int(value) for value in arrays["window"][index])),
            cells[index],
            descriptors[index].astype(np.float32),
            points[index],
            arrays["saliency"][index].astype(np.float32),
            arrays["cls"][index],
            camera,
        )
        for index, camera in enumerate(cameras)
    )
    return EncodedBurst(views, str(arrays["fingerprint"]))


def pose_details_from_arrays(arrays: Mapping[str, Array]) -> PoseDetails | None:
    """What the pose of `features_as_arrays` rested on; None where there was no pose."""
    if "pairs" not in arrays:
        return None
    matches = Matches(**{field.name: arrays[MATCH + field.name] for field in fields(Matches)})
    return PoseDetails(matches, arrays["view_similarity"], tuple((int(reference), int(target)) for reference, target in arrays["pairs"]))
