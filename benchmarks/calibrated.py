"""Episodes as the service lives them: the threshold comes from a rate and from what the memory holds, and there is a third answer.

A known burst joins only above the stricter level; an uncertain one changes nothing. The rate is about objects of no known category, so
they are what it is tested on: the share of them that were called known. The first burst of an episode meets an empty memory and is
not counted.

Letters: E episodes, T rates, N bursts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields

import numpy as np
from numpy.typing import NDArray

from benchmarks.best_pairs import BestPairs, BestSource, IntArray
from core.calibration import Calibration, Samples
from core.views import FloatArray

RATES = (0.005, 0.01, 0.02, 0.05)
"""False-known rates asked for."""


@dataclass(frozen=True, eq=False)
class Answers:
    """Numbers of bursts, repeats left out, each of shape (E, T)."""

    unknown: IntArray
    """Of no category that the memory holds."""
    false_known: IntArray
    """Of those, called known."""
    unknown_uncertain: IntArray
    """Of those, called uncertain."""
    new: IntArray
    """Of those, the first of their kind to be presented: later ones are of kinds that were called uncertain before, so harder."""
    new_false_known: IntArray
    """Of these, called known."""
    holding: IntArray
    """Of a category that the memory holds."""
    missed: IntArray
    """Of those, called novel."""
    mistaken: IntArray
    """Of those, called known as a category whose majority is of another kind."""
    holding_uncertain: IntArray
    """Of those, called uncertain."""
    categories: IntArray
    """In the memory at the end."""

    def __add__(self, other: Answers) -> Answers:
        return Answers(*(np.concatenate([getattr(self, each.name), getattr(other, each.name)]) for each in fields(self)))


def episode(pairs: BestPairs, labels: NDArray[np.intp], order: Sequence[int], rates: Sequence[float] = RATES) -> Answers:
    """One episode over the bursts at `order`, for every rate side by side, given the true category of every burst, shape (N,)."""
    rows, used = np.arange(len(rates)), np.zeros(len(rates), dtype=np.intp)
    kind = pairs.prior.of(pairs.agreement is not None)
    rivals: list[list[float]] = [[] for _ in rates]
    votes = np.zeros((len(rates), len(order), int(labels.max()) + 1), dtype=np.intp)
    counts = {each.name: np.zeros(len(rates), dtype=np.intp) for each in fields(Answers)}
    source = BestSource(pairs, len(order))
    source.begin(len(rates))
    met: set[int] = set()
    kinds: set[int] = set()
    for position, burst in enumerate(order):
        label = int(labels[burst])
        threshold, uncertain_above, learn_above, likely_above = _levels(rivals, rates, kind)
        chosen, evidence = source.nearest(burst, used)
        known = evidence > threshold
        uncertain = ~known & (evidence > uncertain_above)
        novel = ~known & ~uncertain
        if position and burst not in met:
            held = votes[:, :, label].any(axis=1)
            joined = votes[rows, chosen]
            wrong = known & (joined[:, label] < joined.max(axis=1))
            for name, which in (
                ("unknown", ~held),
                ("false_known", ~held & known),
                ("unknown_uncertain", ~held & uncertain),
                ("new", ~held & (label not in kinds)),
                ("new_false_known", ~held & known & (label not in kinds)),
                ("holding", held),
                ("missed", held & novel),
                ("mistaken", held & wrong),
                ("holding_uncertain", held & uncertain),
            ):
                counts[name] += which
        likely = known | (uncertain & (evidence > likely_above))
        best_wrong = _best_wrong(source, burst, used, chosen, likely, evidence)
        for row in np.flatnonzero(np.isfinite(best_wrong)):
            rivals[row].append(float(best_wrong[row]))
        learnt = np.flatnonzero(novel | (evidence > learn_above))
        place = np.where(novel, used, chosen)[learnt]
        votes[learnt, place, label] += 1
        source.learn(burst, place, learnt)
        used = used + novel
        met.add(burst)
        kinds.add(label)
    counts["categories"] = used
    return Answers(**{name: each[None] for name, each in counts.items()})


def _best_wrong(
    source: BestSource, burst: int, used: IntArray, chosen: IntArray, known: NDArray[np.bool_], evidence: FloatArray
) -> FloatArray:
    """Evidence for the best category that is wrong as far as the decision tells, shape (T,)."""
    if not known.any():
        return evidence
    _, others = source.ranked(burst, used, np.where(known, chosen, -1), source.tried)
    return np.where(known, others[:, 0], evidence)


def _levels(rivals: Sequence[Sequence[float]], rates: Sequence[float], prior: Samples) -> FloatArray:
    """Threshold, lower and learning level of each rate, and where right and wrong are as likely, shape (4, T)."""
    levels = []
    for values, rate in zip(rivals, rates):
        calibration = Calibration.fit(values, prior)
        levels.append([*astuple(calibration.levels(rate)), calibration.even])
    return np.array(levels).T
