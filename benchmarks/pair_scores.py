"""Similarities between every two bursts, and from them the similarity of any set of bursts to any burst.

A category is a set of bursts. What each of them has to do with a burst adds up, or the largest counts (`core.scores`); with that kept for
every pair, thousands of episodes need no token again.

Letters: N bursts, P and Q pairs of them; a leading * is any batch of sets.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from core.encode import EncodedBurst
from core.scores.base import Aggregation, Score
from core.views import FloatArray


@dataclass(frozen=True, eq=False)
class PairScores:
    """One score's part for every ordered pair (member i, target j)."""

    aggregation: Aggregation
    views: NDArray[np.intp]
    """Number of views of each burst, shape (N,)."""
    part: FloatArray
    """What a member gives to its category's similarity with a target, shape (N, N): their own, for a mean times the member's views."""

    @staticmethod
    def of(bursts: Sequence[EncodedBurst], score: Score) -> PairScores:
        """From the tokens of every burst."""
        tokens = [score.tokens(burst) for burst in bursts]
        views = np.array([len(each) for each in tokens])
        part = np.array([[score.similarity(member, target) for target in tokens] for member in tokens])
        if score.aggregation == "mean":
            part *= views[:, None]
        return PairScores(score.aggregation, views, part.astype(np.float32))

    @property
    def none(self) -> float:
        """The part of a set without members."""
        return -np.inf if self.aggregation == "max" else 0.0

    def joined(self, part: FloatArray, more: FloatArray) -> FloatArray:
        """The part of two sets together, from that of each, both of one shape."""
        return np.asarray(np.maximum(part, more) if self.aggregation == "max" else part + more)

    def similarity(self, part: FloatArray, views: NDArray[Any]) -> FloatArray:
        """Similarity of sets to a burst, from their parts and their numbers of views, at least 1, both shape (*)."""
        return np.asarray(part / views) if self.aggregation == "mean" else part

    def single(self) -> FloatArray:
        """Similarity of every burst alone to every burst, shape (N, N)."""
        return self.similarity(self.part, self.views[:, None])


def auroc(positive: FloatArray, negative: FloatArray) -> float:
    """Probability that a positive, shape (P,), exceeds a negative, shape (Q,), ties counted half; NaN where one side is empty."""
    if not len(positive) or not len(negative):
        return float("nan")
    ranks = rankdata(np.concatenate([positive, negative]))[: len(positive)]
    return float((ranks.sum() - len(positive) * (len(positive) + 1) / 2) / (len(positive) * len(negative)))


def same_and_other(single: FloatArray, labels: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
    """Similarities of pairs of different bursts, of all in `single`, shape (N, N): of one category, shape (P,), and of two, shape (Q,).

    `labels`, here and below: the category of each burst, shape (N,).
    """
    same = labels[:, None] == labels[None, :]
    different_bursts = ~np.eye(len(labels), dtype=bool)
    return single[same & different_bursts], single[~same]


def nearest_accuracy(single: FloatArray, labels: NDArray[np.intp]) -> float:
    """Share of bursts whose most similar other burst is of their category, of those that have one."""
    others = np.where(np.eye(len(labels), dtype=bool), -np.inf, single)
    has_other = np.bincount(labels)[labels] > 1
    right = labels[others.argmax(axis=0)] == labels
    return float(right[has_other].mean())


def hardest(single: FloatArray, labels: NDArray[np.intp]) -> int:
    """The burst whose most similar burst of its kind leads least over the most similar one of another, both ways taken together."""
    both = (single + single.T) / 2
    same = labels[:, None] == labels[None, :]
    own = np.where(same & ~np.eye(len(labels), dtype=bool), both, -np.inf).max(axis=0)
    lead = own - np.where(same, -np.inf, both).max(axis=0)
    return int(np.where(np.isfinite(lead), lead, np.inf).argmin())
