"""The thresholds at which a score is run through episodes.

Letters: N bursts, T thresholds.
"""

from __future__ import annotations

import numpy as np

from benchmarks.best_pairs import BestPairs
from benchmarks.pair_scores import PairScores
from core.calibration import Calibration, Prior
from core.novelty import DecisionConfig
from core.scores import SCORES
from core.views import FloatArray

LEVELS = np.concatenate([np.linspace(0, 0.9, 7), 1 - np.geomspace(0.1, 0.001, 10)])
"""Quantiles of the similarities between bursts at which a curve has a threshold."""
TRADE, TRADE_ABOVE = 40, 0.9
"""So many thresholds between this quantile and the most similar pair, evenly spaced: here the errors trade."""
BEYOND = 8
"""Thresholds between the most similar pair of bursts and a burst to itself: evidence in a small memory is larger than between many."""
SUMS = 30
"""Further thresholds of a sum, which grows with the members of a category."""
SUM_REACH = 10.0
"""How far those reach: the sum over all bursts, each presented this often."""
TINY = 1e-3
"""Added to the largest similarity, so that a curve ends with everything novel."""


def default_threshold(name: str, pairs: PairScores | BestPairs) -> float:
    """The threshold of a score where nobody says otherwise; of `best` the one of a memory that has met nothing."""
    if name in SCORES:
        return SCORES[name].threshold
    verified = isinstance(pairs, BestPairs) and pairs.agreement is not None
    return Calibration.fit([], Prior.shipped().of(verified)).threshold(DecisionConfig.false_known_rate)


def threshold_grid(name: str, pairs: PairScores | BestPairs, single: FloatArray, own: float) -> FloatArray:
    """Ascending thresholds, shape (T,): where similarities lie, the score's own, and one that no new burst exceeds.

    Args:
        single: similarities between bursts, each alone, shape (N, N).
        own: of `default_threshold`.
    """
    top = float(single.max())  # of a burst to itself
    between = single[~np.eye(len(single), dtype=bool)]
    largest = float(between.max())
    trade = np.linspace(float(np.quantile(between, TRADE_ABOVE)), largest, TRADE)
    grid = [np.quantile(between, LEVELS), trade, np.linspace(largest, top, BEYOND), [own, top + TINY]]
    if isinstance(pairs, BestPairs):
        grid.append([pairs.most() + TINY])
    elif pairs.aggregation == "sum":
        grid.append(np.geomspace(top, pairs.part.sum(axis=0).max() * SUM_REACH + TINY, SUMS))
    return np.unique(np.concatenate(grid))
