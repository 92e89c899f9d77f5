"""The paper's continual setting, at many thresholds at once ("Novel category discovery").

A memory starts empty. Bursts arrive in random order; each joins the category it is most similar to where that exceeds the
threshold, else founds a new one. A false positive joined a category whose majority is of another true category; a false
negative founded one though its own had been seen. A repeat of a burst seen before is learnt from but not counted: it is
trivially known.

Letters: T thresholds, C categories of the memory (room for them), K true categories, N bursts, G views.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.pair_scores import FloatArray, PairScores


@dataclass(frozen=True, eq=False)
class Counts:
    """What was counted over some bursts; counts of episodes add up."""

    false_positive: NDArray[np.intp]
    """Shape (T,)."""
    false_negative: NDArray[np.intp]
    """Shape (T,)."""
    presented: int
    """Bursts, repeats left out."""
    seen: int
    """Those of them whose category had been seen."""

    def __add__(self, other: Counts) -> Counts:
        return Counts(
            self.false_positive + other.false_positive,
            self.false_negative + other.false_negative,
            self.presented + other.presented,
            self.seen + other.seen,
        )

    @property
    def fp(self) -> FloatArray:
        """False positives in percent of the bursts presented, shape (T,)."""
        return np.asarray(100 * self.false_positive / max(self.presented, 1))

    @property
    def fn(self) -> FloatArray:
        """False negatives in percent of the bursts whose category had been seen, shape (T,)."""
        return np.asarray(100 * self.false_negative / max(self.seen, 1))


class Memory:
    """T memories side by side, one for each threshold, fed with the same bursts."""

    def __init__(self, pairs: PairScores, labels: NDArray[np.intp], thresholds: FloatArray, room: int) -> None:
        self._pairs, self._labels, self._thresholds = pairs, labels, thresholds
        count, (bursts, _, views) = len(thresholds), pairs.best.shape
        self._categories = np.zeros(count, dtype=np.intp)
        self._total = np.zeros((count, room, bursts), dtype=np.float32)
        self._best = np.full((count, room, bursts, views), -1, dtype=np.float32)
        self._views = np.zeros((count, room), dtype=np.intp)
        self._votes = np.zeros((count, room, int(labels.max()) + 1), dtype=np.intp)

    def meet(self, burst: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Decides for `burst` and learns it. Returns whether it was known, and known but to another majority, shapes (T,), (T,)."""
        rows, used = np.arange(len(self._thresholds)), int(self._categories.max())
        chosen, known = self._categories.copy(), np.zeros(len(rows), dtype=bool)
        if used:
            views = np.maximum(self._views[:, :used], 1)
            similarity = self._pairs.similarity(self._total[:, :used, burst], self._best[:, :used, burst], views, burst)
            similarity = np.where(np.arange(used) < self._categories[:, None], similarity, -np.inf)
            nearest = similarity.argmax(axis=1)
            known = similarity[rows, nearest] > self._thresholds
            chosen = np.where(known, nearest, chosen)
        votes = self._votes[rows, chosen]
        wrong = known & (votes[:, self._labels[burst]] < votes.max(axis=1))
        self._learn(burst, rows, chosen)
        self._categories += ~known
        return known, wrong

    def _learn(self, burst: int, rows: NDArray[Any], chosen: NDArray[np.intp]) -> None:
        self._total[rows, chosen] += self._pairs.total[burst]
        self._best[rows, chosen] = np.maximum(self._best[rows, chosen], self._pairs.best[burst])
        self._views[rows, chosen] += self._pairs.views[burst]
        self._votes[rows, chosen, self._labels[burst]] += 1


def episode(pairs: PairScores, labels: NDArray[np.intp], order: Sequence[int], thresholds: FloatArray) -> Counts:
    """One episode over the bursts at `order`.

    Args:
        labels: true category of every burst, 0 to K − 1, shape (N,).
        thresholds: shape (T,).
    """
    memory = Memory(pairs, labels, thresholds, len(order))
    counts = Counts(np.zeros(len(thresholds), dtype=np.intp), np.zeros(len(thresholds), dtype=np.intp), 0, 0)
    for position, burst in enumerate(order):
        before = order[:position]
        known, wrong = memory.meet(burst)
        if burst in before:
            continue
        seen = bool((labels[list(before)] == labels[burst]).any()) if before else False
        counts += Counts(wrong.astype(np.intp), (~known & seen).astype(np.intp), 1, int(seen))
    return counts


def draw_orders(count: int, bursts: int, length: int, seed: int) -> list[list[int]]:
    """`count` seeded episodes of `length` bursts drawn at random with replacement, as the paper does (250 of 200)."""
    return np.random.default_rng(seed).integers(bursts, size=(count, length)).tolist()
