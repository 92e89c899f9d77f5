"""The recipe of zero-shot-pose (Goodwin 2022) as its authors wrote it, for comparison: one query patch at a time, scikit-image's RANSAC.

Letters: P and Q patches of two views, C descriptor size, K correspondences.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from skimage.measure import ransac
from skimage.transform import SimilarityTransform

from core.errors import NoPose
from core.matched_pair import MatchedPair
from core.views import FloatArray

CORRESPONDENCES = 50
"""K."""
TRIALS = 1000
"""Of RANSAC, at most."""


class Similarity(SimilarityTransform):
    """Of space: scikit-image makes an empty transform before it fits one, of the plane unless told otherwise."""

    def __init__(self, matrix: FloatArray | None = None, *, dimensionality: int = 3) -> None:
        super().__init__(matrix, dimensionality=dimensionality)  # type: ignore[no-untyped-call]


def solve(pair: MatchedPair, threshold_m: float, seed: int) -> FloatArray:
    """target_from_reference, shape (4, 4), of a pair's descriptors and points; the pair's own matches are not used.

    Every target view takes the reference view of largest similarity, as the paper's multi-view form of the recipe does. Raises NoPose
    where RANSAC finds nothing.
    """
    of_reference, of_target = pair.descriptors
    source, aim = [], []
    for target_view, target in zip(pair.target, of_target):
        found = [_matches(reference, target) for reference in of_reference]
        best = int(np.argmax([similarity.sum() for _, _, similarity in found]))
        source.append(pair.reference[best].points_m[found[best][0]])
        aim.append(target_view.points_m[found[best][1]])
    points, aims = np.concatenate(source), np.concatenate(aim)
    options = {"min_samples": 4, "residual_threshold": threshold_m, "max_trials": TRIALS, "rng": seed}
    model, _ = ransac((points, aims), Similarity, **options)  # type: ignore[no-untyped-call]
    if not model:
        raise NoPose("no similarity fits")
    return np.asarray(model.params)


def bare_products(reference: Sequence[FloatArray], target: Sequence[FloatArray]) -> FloatArray:
    """Cosines of all patches of all view pairs in one product, and nothing else; rows are the reference's patches, columns the target's."""
    sides = [torch.from_numpy(np.concatenate(vectors)) for vectors in (reference, target)]
    return np.asarray(sides[0] @ sides[1].T)


def _matches(reference: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Patches and similarities of the K correspondences of two views, shapes (P, C) and (Q, C), whose cycles end nearest in similarity."""
    rows = []
    for query, descriptor in enumerate(reference):
        there = target @ descriptor
        match = int(there.argmax())
        back = reference @ target[match]
        rows.append((float(back[back.argmax()] - back[query]), query, match, float(there[match])))
    rows.sort()
    kept = np.array(rows[:CORRESPONDENCES]).reshape(-1, 4)
    return kept[:, 1].astype(int), kept[:, 2].astype(int), kept[:, 3]
