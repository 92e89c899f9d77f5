"""Directions in which tokens tell an object's points apart, whichever view they come from.

A token changes with the side that its point is seen from and with its place in the crop; principal components keep that change as
gladly as what the point is. Views with depth show the same points again and again, so the change can be measured without any label,
and Fisher's criterion (1936) keeps the directions that vary between points and not within one.

Letters: D token size, E pairs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.spatial import cKDTree

from core.boxes import cloud_extent_m
from core.encode import EncodedView
from core.views import FloatArray

SAME_POINT = 0.03
"""Patches of different views nearer than this share of the object's extent show one point; about the size of a patch."""
MOST_PAIRS = 5000
"""Pairs that the change is measured from; more say nothing new."""
FEWEST_PAIRS = 2000
"""Fewer pairs than this, of a few hundred directions, are not heard beside an object that has more."""
SHRINKAGE = 0.1
"""Share of the mean variance added in every direction: what was never seen to change may still do so."""


def discriminant_directions(objects: Sequence[Sequence[EncodedView]], dims: int) -> NDArray[np.float32]:
    """Directions of largest ratio of variance between points to variance within one, shape (D, min(dims, D)), of variance 1 within.

    Args:
        objects: views with trusted patches only, of one object each; the variance between points is the first one's, the variance
            within a point the mean over those that show enough points in two views.
    """
    tokens = np.concatenate([view.descriptors for view in objects[0]])
    between = np.cov(tokens.T, dtype=np.float32)
    changes = [change for change in map(_change_between_views, objects) if change is not None and len(change) >= FEWEST_PAIRS]
    within = sum((change.T @ change / len(change) / 2 for change in changes), np.zeros_like(between)) / max(len(changes), 1)
    within += max(SHRINKAGE * float(np.trace(between)) / len(between), 1e-6) * np.eye(len(between), dtype=np.float32)
    _, vectors = eigh(between, within, subset_by_index=(max(len(between) - dims, 0), len(between) - 1))
    return np.ascontiguousarray(vectors[:, ::-1], dtype=np.float32)


def _change_between_views(views: Sequence[EncodedView]) -> FloatArray | None:
    """Differences of tokens of one point in two views, shape (E, D); None where there is no point."""
    if not any(len(view.points_m) for view in views):
        return None
    points = np.concatenate([view.points_m for view in views])
    of_view = np.repeat(np.arange(len(views)), [len(view.points_m) for view in views])
    pairs = cKDTree(points).query_pairs(SAME_POINT * cloud_extent_m(points), output_type="ndarray")
    pairs = pairs[of_view[pairs[:, 0]] != of_view[pairs[:, 1]]]
    chosen = pairs[np.random.default_rng(0).permutation(len(pairs))[:MOST_PAIRS]]
    tokens = np.concatenate([view.descriptors for view in views])
    return np.asarray(tokens[chosen[:, 0]] - tokens[chosen[:, 1]])
