"""What an observation was decided from, as plain arrays: its pictures, and a scan begun later, need no second encoding.

Letters: V views, K correspondences, M reference views.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from core.encode import EncodedBurst
from core.matches import Matches
from core.packing import burst_as_arrays
from core.pose_estimate import PoseEstimate
from store.arrays import Array

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
    """Arrays for one npz file."""
    arrays = burst_as_arrays(encoded)
    if estimate is not None:
        arrays |= {MATCH + field.name: getattr(estimate.matches, field.name) for field in fields(Matches)}
        arrays |= {"view_similarity": estimate.view_similarity, "pairs": np.array(estimate.pairs, dtype=int).reshape(-1, 2)}
    return arrays


def pose_details_from_arrays(arrays: Mapping[str, Array]) -> PoseDetails | None:
    """What the pose of `features_as_arrays` rested on; None where there was no pose."""
    if "pairs" not in arrays:
        return None
    matches = Matches(**{field.name: arrays[MATCH + field.name] for field in fields(Matches)})
    return PoseDetails(matches, arrays["view_similarity"], tuple((int(reference), int(target)) for reference, target in arrays["pairs"]))
