"""Patch correspondences of reference–target view pairs (paper, "Descriptors and correspondences").

Letters: M reference views, N target views, P_m patches of a view, P and Q the most of any, C descriptor size, K correspondences a pair.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import torch
from torch import Tensor

from core.views import FloatArray

METHODS = ("nearest", "mutual", "cyclical", "cyclical-3d")
TIE_BREAK = 1e-3
"""Weight of 1 − cosine beside the cycle's length: too small to outweigh one patch or a few millimetres."""


@dataclass(frozen=True, eq=False)
class PatchSet:
    """The patches of several views."""

    descriptors: Sequence[FloatArray]
    """Unit vectors, one array a view, shape (P_m, C)."""
    places: Tensor
    """Where each patch is, for the cycle's length: grid cells or metres, shape (M, P, 2 or 3); P is the largest P_m, at least 1."""

    @staticmethod
    def of(descriptors: Sequence[FloatArray], places: Sequence[FloatArray]) -> PatchSet:
        """From one array a view, shapes (P_m, C) and (P_m, 2 or 3)."""
        padded = torch.zeros(len(places), max(1, *map(len, places)), places[0].shape[1])
        for view, where in enumerate(places):
            padded[view, : len(where)] = torch.from_numpy(where)
        return PatchSet(descriptors, padded)


@dataclass(frozen=True, eq=False)
class PairMatches:
    """K correspondences of every view pair, best first."""

    reference_patch: Tensor
    """Shape (M, N, K)."""
    target_patch: Tensor
    """Shape (M, N, K)."""
    similarity: Tensor
    """Cosine, shape (M, N, K); 0 where not valid."""
    valid: Tensor
    """False where a pair has fewer than K, shape (M, N, K)."""

    def view_similarity(self) -> Tensor:
        """S of the paper, shape (M, N): the sum over a pair's correspondences."""
        return self.similarity.sum(dim=-1)


def match(
    reference: PatchSet, target: PatchSet, count: int, method: str = "cyclical", pairs: Iterable[tuple[int, int]] | None = None
) -> PairMatches:
    """The `count` best correspondences of view pairs.

    Args:
        method: one of METHODS. `nearest`: each reference patch's nearest target patch, ranked by similarity. `mutual`: only
            pairs that choose each other. `cyclical`: ranked by the distance between a reference patch and where the cycle
            reference → target → reference ends (mutual ones first, at distance 0; Goodwin 2022), ties by similarity; in patches, or
            in metres as the appendix proposes (`cyclical-3d`), depending on `reference.places`.
        pairs: the (reference view, target view) to match, all where None; others have no correspondences.
    """
    forward, nearest_target, nearest_reference, usable = _nearest(reference, target, pairs)
    cycle_end = nearest_reference.gather(2, nearest_target)
    cost = 1.0 - forward
    own = torch.arange(cycle_end.shape[2])
    if method == "mutual":
        usable = usable & (cycle_end == own)
    elif method.startswith("cyclical"):
        rows = torch.arange(len(reference.places))[:, None, None]
        moved = torch.linalg.norm(reference.places[rows, cycle_end] - reference.places[:, None], dim=-1)
        cost = cost * TIE_BREAK + moved
    cost = cost.masked_fill(~usable, torch.inf)
    kept = min(count, cost.shape[2])
    cost, reference_patch = cost.topk(kept, dim=2, largest=False)
    valid = torch.isfinite(cost)
    return PairMatches(
        reference_patch,
        nearest_target.gather(2, reference_patch),
        forward.gather(2, reference_patch).masked_fill(~valid, 0.0),
        valid,
    )


def _nearest(reference: PatchSet, target: PatchSet, pairs: Iterable[tuple[int, int]] | None) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Of each reference patch the largest cosine in a target view, which patch has it, and whether there is one, each (M, N, P); of each
    target patch the nearest reference patch, (M, N, Q).

    One pair of views at a time, by numpy, whose product stays in the processor's cache and whose search along rows is the quickest. The
    way back is a second product: cheaper than a search along columns.
    """
    (views, patches), (target_views, target_patches) = reference.places.shape[:2], target.places.shape[:2]
    cosine = np.zeros((views, target_views, patches), dtype=np.float32)
    to_target = np.zeros((views, target_views, patches), dtype=np.int64)
    to_reference = np.zeros((views, target_views, target_patches), dtype=np.int64)
    usable = np.zeros(cosine.shape, dtype=bool)
    for m, n in product(range(views), range(target_views)) if pairs is None else pairs:
        here, there = reference.descriptors[m], target.descriptors[n]
        if not (len(here) and len(there)):
            continue
        similarity = here @ there.T
        nearest = similarity.argmax(axis=1)
        to_target[m, n, : len(here)], to_reference[m, n, : len(there)] = nearest, (there @ here.T).argmax(axis=1)
        cosine[m, n, : len(here)] = similarity[np.arange(len(here)), nearest]
        usable[m, n, : len(here)] = True
    return torch.from_numpy(cosine), torch.from_numpy(to_target), torch.from_numpy(to_reference), torch.from_numpy(usable)
