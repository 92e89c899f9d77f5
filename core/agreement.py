"""Whether the views of a burst show the same thing: of one in which table or room were taken for the object, what is not the object goes.

Letters: V views, P foreground patches of a view.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from core.boxes import cloud_extent_m
from core.encode import EncodedBurst, EncodedView

FloatArray = NDArray[np.floating]
LEAST_VIEWS = 3
"""With depth on the object: of two that differ nothing says which is right."""
MOST_WIDER = 2.0
"""Times the median view's extent that an object may seem wide in one view. Of 155 bursts the widest view is up to 1.7 times as wide
where all show the object, whatever side they see, and 2.1 to 26 times where one shows what is behind or below it."""
REACH = 0.75
"""Of the object's extent, from its middle: where the others have it. In views that show it alone all patches are nearer."""
LEAST_KEPT = 0.5
"""Share of such a view's patches that must be where the other views have the object; else all of it is something else."""


def agreeing(encoded: EncodedBurst) -> EncodedBurst:
    """The burst without what a view shows far from where most views have the object.

    A view of which little is left then has no patches, as if no object had been found in it.
    """
    clouds = [view.points_m[view.trusted] for view in encoded.views]
    extents_m = np.array([cloud_extent_m(cloud) for cloud in clouds])
    measured = extents_m > 0
    if measured.sum() < LEAST_VIEWS:
        return encoded
    extent_m = float(np.median(extents_m[measured]))
    center = np.median([np.median(cloud, axis=0) for cloud, shown in zip(clouds, measured) if shown], axis=0)
    wide = extents_m > MOST_WIDER * extent_m
    return replace(encoded, views=tuple(_within(view, center, extent_m) if odd else view for view, odd in zip(encoded.views, wide)))


def _within(view: EncodedView, center: FloatArray, extent_m: float) -> EncodedView:
    """Its patches within REACH of `center`, shape (3,); those without depth say nothing, and go."""
    kept = np.linalg.norm(np.where(view.trusted[:, None], view.points_m, np.inf) - center, axis=1) < REACH * extent_m
    if kept.mean() < LEAST_KEPT:
        kept[:] = False
    pooled = view.pooled if kept.any() else np.zeros_like(view.pooled)
    return replace(view, cells=view.cells[kept], descriptors=view.descriptors[kept], points_m=view.points_m[kept], pooled=pooled)
