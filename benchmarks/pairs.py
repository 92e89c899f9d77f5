"""Which objects a benchmark takes, in pairs, and which of their views. What is sampled is seeded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from zlib import crc32

import numpy as np

from clients.datasets import folders
from core.errors import InvalidInput, NoPose

Pair = tuple[folders.Sequence, folders.Sequence]
"""(reference, target)"""
UNPOSED = (NoPose, InvalidInput)
"""What an estimate raises where nothing fits, or the target's views show nothing of the object."""


@dataclass(frozen=True)
class ViewCounts:
    """How many views the reference and the target have."""

    text: str
    """As the caller wrote it."""
    reference: int | None
    """None is all there are."""
    target: int | None

    @staticmethod
    def all() -> ViewCounts:
        """Every view there is."""
        return ViewCounts("all", None, None)

    @staticmethod
    def parse(text: str) -> ViewCounts:
        """`10` is 10 + 10 views; `10+3` is 10 of the reference and 3 of the target; `all` is every view there is.

        Raises InvalidInput for anything else.
        """
        if text == "all":
            return ViewCounts.all()
        parts = text.split("+")
        if len(parts) > 2 or not all(part.isdecimal() and int(part) > 0 for part in parts):
            raise InvalidInput("views", f"expected a count such as 10, reference+target such as 10+3, or all, found {text!r}")
        return ViewCounts(text, int(parts[0]), int(parts[-1]))


def sample_pairs(sequences: Sequence[folders.Sequence], limit: int, seed: int) -> list[Pair]:
    """At most `limit` ordered pairs of different instances for each category; a smaller limit takes a prefix of a larger one's.

    Raises InvalidInput where no category has two instances, or one of them has no ground truth.
    """
    pairs: list[Pair] = []
    for category, group in folders.by_category(sequences).items():
        candidates = [(a, b) for a in group for b in group if a.instance != b.instance]
        order = np.random.default_rng([seed, crc32(category.encode())]).permutation(len(candidates))
        pairs += [candidates[index] for index in order[:limit]]
    require_true_poses([sequence for pair in pairs for sequence in pair])
    return pairs


def require_true_poses(sequences: Sequence[folders.Sequence]) -> None:
    """Raises InvalidInput where none is left to be posed against another, or one has no ground truth."""
    if not sequences:
        raise InvalidInput("data", "no category has two instances, so there is no pair to estimate")
    for sequence in sequences:
        if sequence.world_from_model is None:
            raise InvalidInput(str(sequence.path), "has no true pose (scene_gt.json, class_labels), which poses are scored against")


def require_views(sequences: Sequence[folders.Sequence], counts: Sequence[ViewCounts]) -> None:
    """Raises InvalidInput for a sequence that has fewer views than one of the counts asks for."""
    most = max(max(count.reference or 0, count.target or 0) for count in counts)
    for sequence in sequences:
        if len(sequence.images) < most:
            raise InvalidInput("views", f"{most} were asked for, but {sequence.name} has {len(sequence.images)}; ask for fewer")


def two_of_a_kind(sequences: Sequence[folders.Sequence], views: int) -> list[folders.Sequence]:
    """The first two of one category that have so many views. Raises InvalidInput where there are none."""
    for group in folders.by_category(sequences).values():
        enough = [sequence for sequence in group if len(sequence.images) >= views]
        if len(enough) > 1:
            return enough[:2]
    raise InvalidInput("data", f"no category has two objects of {views} or more views")


def choose_views(name: str, role: str, available: int, count: int | None, seed: int) -> list[int]:
    """`count` of the `available` views of sequence `name`, ascending indices; None is all.

    Evenly spaced in the order of recording, as Goodwin 2022 samples them, from a random first one for each `role` ("reference" or
    "target").
    """
    chosen = available if count is None else count
    first = np.random.default_rng([seed, crc32(name.encode()), crc32(role.encode())]).integers(available)
    return sorted(((np.arange(chosen) * available // chosen + first) % available).tolist())
