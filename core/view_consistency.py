"""Whether the views of a burst show the same thing: what of a view's foreground the others contradict goes, for it is not the object.

A point of the object is seen by the other views, too, or something of the object hides it there. Of what else a picture shows, a hand, an
arm, table and room, things around, another view sees that it is not there, or sees it away from what it takes for the object.

Letters: P foreground patches of a view, N of all views.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from core.boxes import cloud_extent_m
from core.encode import EncodedBurst, EncodedView
from core.views import FloatArray

Kept = NDArray[np.bool_]

LEAST_VIEWS = 3
"""With depth on the object: of two that differ nothing says which is right."""
LEAST_AGREED = 0.1
"""Share of all patches that must be left; with less the cameras are wrong, and say nothing of single patches."""
SAME = 0.1
"""Share of the object's extent by which two depths of one point may differ."""
SEEN, HIDDEN, ABSENT = 1.0, 0.5, -1.0
"""What a view says of a point that it sees, that its own foreground hides, and that is not there or not foreground."""
NEIGHBOURS = tuple(product((-1, 0, 1), repeat=2))
"""A patch and those around it: cells are coarse, and cameras a little wrong."""
BORDER = 3
"""Patches around a map, so that what projects beside the window has neighbours, too."""


def consistent_only(encoded: EncodedBurst) -> EncodedBurst:
    """The burst with the patches of each view that the other views speak for at least as much as against; those without depth stay.

    A view of which nothing is left has no patches, as if no object had been found in it. `cls` and, where patches are left, `pooled` stay
    those of all that was found.
    """
    shown = [index for index, view in enumerate(encoded.views) if view.camera is not None and view.trusted.any()]
    if len(shown) < LEAST_VIEWS:
        return encoded
    kept = _uncontradicted([encoded.views[index] for index in shown])
    if np.concatenate(kept).mean() < LEAST_AGREED:
        return encoded
    left = dict(zip(shown, kept))
    return replace(encoded, views=tuple(_only(view, left[index]) if index in left else view for index, view in enumerate(encoded.views)))


def _uncontradicted(views: Sequence[EncodedView]) -> list[Kept]:
    """Of each view, shape (P,)."""
    points = np.concatenate([view.points_m for view in views])
    counts = [len(view.cells) for view in views]
    owner = np.repeat(np.arange(len(views)), counts)
    same_m = SAME * float(np.median([cloud_extent_m(view.points_m[view.trusted]) for view in views]))
    votes = sum(np.where(owner == index, 0.0, _says(view, points, same_m)) for index, view in enumerate(views))
    return np.split(votes >= 0, np.cumsum(counts)[:-1])


def _says(view: EncodedView, points_m: FloatArray, same_m: float) -> FloatArray:
    """What a view says for each point of the world, shape (N,) from (N, 3); 0 where it cannot tell."""
    assert view.camera is not None
    side = view.grid + 2 * BORDER
    foreground, depth = np.zeros((side, side), dtype=bool), np.full((side, side), np.nan)
    rows, columns = (view.cells + BORDER).T
    foreground[rows, columns] = True
    depth[rows, columns] = view.camera.project(view.points_m)[1]
    pixels, away = view.camera.project(points_m)
    usable = away > 0  # and not NaN
    cells = (np.where(usable[:, None], pixels, 0.0) + 0.5 - [view.window.x0, view.window.y0]) * (view.grid / view.window.size)
    across, down = np.clip(np.floor(cells) + BORDER, 1, side - 2).astype(int).T
    around = [(down + below, across + right) for below, right in NEIGHBOURS]
    beyond = np.stack([depth[each] for each in around]) - away
    there = np.stack([foreground[each] for each in around])
    sees, hides = (np.abs(beyond) < same_m).any(axis=0), (beyond <= -same_m).any(axis=0)
    unmeasured = (there & np.isnan(beyond)).any(axis=0)
    return np.where(usable, np.select([sees, hides, unmeasured], [SEEN, HIDDEN, 0.0], ABSENT), 0.0)


def _only(view: EncodedView, kept: Kept) -> EncodedView:
    if kept.all():
        return view
    pooled = view.pooled if kept.any() else np.zeros_like(view.pooled)
    return replace(view, cells=view.cells[kept], descriptors=view.descriptors[kept], points_m=view.points_m[kept], pooled=pooled)
