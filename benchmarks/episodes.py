"""The paper's continual setting, at many thresholds at once ("Novel category discovery").

A memory starts empty. Bursts arrive in random order; each joins the category it is most similar to where that exceeds the
threshold, else founds a new one. A false positive joined a category whose majority is of another true category; a false
negative founded one though its own had been seen. A repeat of a burst met before is learnt from but counted apart: it is
trivially known.

Letters: E episodes, T thresholds, L bursts an episode presents, K true categories, N bursts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from benchmarks.pair_scores import PairScores
from benchmarks.parallel import bar
from clients.datasets import folders
from core.errors import InvalidInput
from core.views import FloatArray

MOST_CATEGORIES, MOST_SEQUENCES = 20, 10
"""The paper's episodes: 10 sequences of each of 20 categories, where there are as many."""
ORDERS = 5
"""Of a memory that holds all other bursts."""


@dataclass(frozen=True, eq=False)
class Counts:
    """What was counted; counts of further episodes add up."""

    false_positive: NDArray[np.intp]
    """Shape (E, T)."""
    false_negative: NDArray[np.intp]
    """Shape (E, T)."""
    presented: NDArray[np.intp]
    """Bursts, repeats left out, shape (E,)."""
    seen: NDArray[np.intp]
    """Those of them whose category had been seen, shape (E,)."""
    repeat_errors: NDArray[np.intp]
    """Repeats that were called novel or joined another category, shape (E, T)."""
    repeats: NDArray[np.intp]
    """Shape (E,)."""
    categories: NDArray[np.intp]
    """Categories of the memory after each burst, summed over episodes, shape (T, L)."""
    truth: NDArray[np.intp]
    """True categories met until then, summed over episodes, shape (L,)."""

    def __add__(self, other: Counts) -> Counts:
        return Counts(
            np.concatenate([self.false_positive, other.false_positive]),
            np.concatenate([self.false_negative, other.false_negative]),
            np.concatenate([self.presented, other.presented]),
            np.concatenate([self.seen, other.seen]),
            np.concatenate([self.repeat_errors, other.repeat_errors]),
            np.concatenate([self.repeats, other.repeats]),
            self.categories + other.categories,
            self.truth + other.truth,
        )

    @property
    def fp(self) -> FloatArray:
        """False positives in percent of the bursts presented, shape (T,)."""
        return np.asarray(100 * self.false_positive.sum(axis=0) / max(self.presented.sum(), 1))

    @property
    def fn(self) -> FloatArray:
        """False negatives in percent of the bursts whose category had been seen, shape (T,)."""
        return np.asarray(100 * self.false_negative.sum(axis=0) / max(self.seen.sum(), 1))

    @property
    def repeat_error(self) -> FloatArray:
        """Wrong answers to repeats, in percent of them, shape (T,)."""
        return np.asarray(100 * self.repeat_errors.sum(axis=0) / max(self.repeats.sum(), 1))

    def bands(self, low: float, high: float) -> tuple[FloatArray, FloatArray]:
        """Quantiles over episodes of FP and of FN, each in percent, shape (2, T)."""
        fp = 100 * self.false_positive / np.maximum(self.presented, 1)[:, None]
        fn = 100 * self.false_negative / np.maximum(self.seen, 1)[:, None]
        return np.quantile(fp, [low, high], axis=0), np.quantile(fn, [low, high], axis=0)


class Source(Protocol):
    """Chooses, for T memories side by side, the category most similar to a burst."""

    def begin(self, thresholds: int) -> None:
        """Forgets everything."""

    def nearest(self, burst: int, used: NDArray[np.intp]) -> tuple[NDArray[np.intp], FloatArray]:
        """The category and its similarity for each memory, shapes (T,), (T,), from the numbers of categories they have, shape (T,).

        The similarity is −inf where there is no category.
        """

    def learn(self, burst: int, chosen: NDArray[np.intp], rows: NDArray[np.intp]) -> None:
        """Adds the burst to a category in each memory of `rows`; `chosen` has the shape of `rows`."""


class SetSource:
    """By a score of `core.scores`."""

    def __init__(self, pairs: PairScores, room: int) -> None:
        self._pairs, self._room = pairs, room

    def begin(self, thresholds: int) -> None:
        """See `Source`."""
        self._part = np.full((thresholds, self._room, len(self._pairs.part)), self._pairs.none)
        self._views = np.zeros((thresholds, self._room), dtype=np.intp)

    def nearest(self, burst: int, used: NDArray[np.intp]) -> tuple[NDArray[np.intp], FloatArray]:
        """See `Source`."""
        most = int(used.max())
        if not most:
            return np.zeros_like(used), np.full(len(used), -np.inf)
        views = np.maximum(self._views[:, :most], 1)
        similarity = self._pairs.similarity(self._part[:, :most, burst], views)
        similarity = np.where(np.arange(most) < used[:, None], similarity, -np.inf)
        nearest = similarity.argmax(axis=1)
        return nearest, similarity[np.arange(len(used)), nearest]

    def learn(self, burst: int, chosen: NDArray[np.intp], rows: NDArray[np.intp]) -> None:
        """See `Source`."""
        self._part[rows, chosen] = self._pairs.joined(self._part[rows, chosen], self._pairs.part[burst])
        self._views[rows, chosen] += self._pairs.views[burst]


def episode(source: Source, labels: NDArray[np.intp], order: Sequence[int], thresholds: FloatArray) -> Counts:
    """One episode over the bursts at `order`.

    Args:
        labels: true category of every burst, 0 to K − 1, shape (N,).
        thresholds: shape (T,).
    """
    count, rows = len(thresholds), np.arange(len(thresholds))
    used = np.zeros(count, dtype=np.intp)
    votes = np.zeros((count, len(order), int(labels.max()) + 1), dtype=np.intp)
    wrong_sum, missed_sum, repeat_sum = (np.zeros(count, dtype=np.intp) for _ in range(3))
    categories, truth = np.zeros((count, len(order)), dtype=np.intp), np.zeros(len(order), dtype=np.intp)
    met: set[int] = set()
    kinds: set[int] = set()
    presented = seen = 0
    source.begin(count)
    for position, burst in enumerate(order):
        label = int(labels[burst])
        chosen, similarity = source.nearest(burst, used)
        known = similarity > thresholds
        chosen = np.where(known, chosen, used)
        joined = votes[rows, chosen]
        wrong = known & (joined[:, label] < joined.max(axis=1))
        if burst in met:
            repeat_sum += wrong | ~known
        else:
            presented, seen = presented + 1, seen + (label in kinds)
            wrong_sum += wrong
            missed_sum += ~known & (label in kinds)
        votes[rows, chosen, label] += 1
        source.learn(burst, chosen, rows)
        used = used + ~known
        met.add(burst)
        kinds.add(label)
        categories[:, position], truth[position] = used, len(kinds)
    one = [np.array([each]) for each in (presented, seen, len(order) - presented)]
    return Counts(wrong_sum[None], missed_sum[None], one[0], one[1], repeat_sum[None], one[2], categories, truth)


def nearest_category(source: Source, labels: NDArray[np.intp]) -> float:
    """Share of bursts whose most similar category is theirs, in a memory that holds all other bursts, each in its true category.

    Mean over ORDERS random orders in which these came: the first of a category founds it. Bursts that are the only ones of their kind
    are not asked. `labels`: as of `episode`.
    """
    rng = np.random.default_rng(0)
    asked = np.flatnonzero(np.bincount(labels)[labels] > 1)
    right = 0
    with bar() as progress:
        for burst in progress.track(np.tile(asked, ORDERS), description="asking who is nearest"):
            source.begin(1)
            for other in rng.permutation(np.delete(np.arange(len(labels)), burst)):
                source.learn(int(other), labels[[other]], np.array([0]))
            chosen, _ = source.nearest(int(burst), labels.max(keepdims=True) + 1)
            right += int(chosen[0] == labels[burst])
    return right / (ORDERS * len(asked))


def labels_of(sequences: Sequence[folders.Sequence]) -> NDArray[np.intp]:
    """The true category of each burst as a number from 0 on, shape (N,).

    Raises InvalidInput where there are not two, and two objects of one of them: nothing could be told apart.
    """
    labels = np.unique([sequence.category for sequence in sequences], return_inverse=True)[1]
    objects = np.bincount(labels)
    if len(objects) < 2 or objects.max() < 2:
        raise InvalidInput("data", f"expected two categories, and two objects of one of them; {len(labels)} of {len(objects)} were found")
    return labels


def draw_orders(count: int, labels: NDArray[Any], length: int, seed: int) -> list[list[int]]:
    """`count` seeded episodes of `length` bursts, drawn with replacement from MOST_SEQUENCES of each of MOST_CATEGORIES categories.

    `labels`: true category of every burst, shape (N,).
    """
    rng = np.random.default_rng(seed)
    orders: list[list[int]] = []
    for _ in range(count):
        kinds = rng.permutation(np.unique(labels))[:MOST_CATEGORIES]
        pool = np.concatenate([rng.permutation(np.flatnonzero(labels == kind))[:MOST_SEQUENCES] for kind in kinds])
        orders.append(pool[rng.integers(len(pool), size=length)].tolist())
    return orders
