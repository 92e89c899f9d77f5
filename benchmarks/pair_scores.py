"""Similarities between every two bursts, and from them the similarity of any set of bursts to any burst.

A category is a set of bursts. Each score of `core.novelty` is made of parts that add up, or take their maximum, over the
members of the set; with those parts kept for every pair, thousands of episodes need no token again.

Letters: N bursts, G parts of a pair, D token size; a leading * is any batch of sets.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from core.descriptors import unit
from core.encode import EncodedBurst
from core.errors import InvalidInput
from core.novelty import SCORES, paper_sum

FloatArray = NDArray[np.floating[Any]]


@dataclass(frozen=True, eq=False)
class PairScores:
    """One score's parts for every ordered pair (member i, target j)."""

    score: str
    views: NDArray[np.intp]
    """Number of views of each burst, shape (N,)."""
    total: FloatArray
    """The part that adds up over members, shape (N, N): the sum of cosines."""
    best: FloatArray
    """The part that takes its maximum over members, shape (N, N, G); G is 0 where a score has none."""

    @staticmethod
    def of(bursts: Sequence[EncodedBurst], score: str) -> PairScores:
        """Raises InvalidInput for a score of which the parts are not known here."""
        if score not in PARTS:
            raise InvalidInput("score", f"{score!r} is none of {', '.join(PARTS)}")
        token = SCORES[score].token
        tokens = [unit(getattr(burst, token)) for burst in bursts]
        count, most = len(tokens), 1 if PARTS[score] == "maximum" else 0
        total = np.zeros((count, count), dtype=np.float32)
        best = np.zeros((count, count, most), dtype=np.float32)
        for i, member in enumerate(tokens):
            for j, target in enumerate(tokens):
                if most:
                    best[i, j] = SCORES[score].similarity(member, target)
                else:
                    total[i, j] = paper_sum(member, target)
        return PairScores(score, np.array([len(each) for each in tokens]), total, best)

    def similarity(self, total: FloatArray, best: FloatArray, views: NDArray[Any], target: int) -> FloatArray:
        """Similarity of sets to burst `target`, shape (*).

        Args:
            total: sum of the members' `total[:, target]`, shape (*).
            best: maximum of the members' `best[:, target]`, shape (*, G).
            views: the sets' numbers of views, shape (*).
        """
        if self.score == "paper_sum":
            return total
        if self.score == "paper_mean":
            return np.asarray(total / (views * self.views[target]))
        return best[..., 0]

    def single(self) -> FloatArray:
        """Similarity of every burst alone to every burst, shape (N, N)."""
        columns = [self.similarity(self.total[:, j], self.best[:, j], self.views, j) for j in range(len(self.views))]
        return np.stack(columns, axis=1)


PARTS = {"paper_sum": "sum", "paper_mean": "sum", "pooled_best_view": "maximum"}
"""How each score adds up over the bursts of a category."""


def auroc(positive: FloatArray, negative: FloatArray) -> float:
    """Probability that a positive exceeds a negative, ties counted half; NaN where one side is empty."""
    if not len(positive) or not len(negative):
        return float("nan")
    ranks = rankdata(np.concatenate([positive, negative]))[: len(positive)]
    return float((ranks.sum() - len(positive) * (len(positive) + 1) / 2) / (len(positive) * len(negative)))


def same_and_other(single: FloatArray, labels: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
    """Similarities of pairs of different bursts: of the same category, and of two categories."""
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
