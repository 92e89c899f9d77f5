"""From a rate of false answers to a threshold.

What is wanted is how much evidence an object of no known category finds for the best of the wrong ones. Every decision gives one sample
of that, without any label: of a known object the best of the other categories, had its own not been there (its rival); of a novel one the
best of all. No similarity within a category enters, so it does not matter that a category was seen in one instance only, whose views are
more alike than two instances are. That gap shows only where right and wrong are weighed, in the estimated probability and in the point
where they are even: there the shipped figures, which are of different instances, always stand for the right category.

Until the memory has samples of its own the shipped ones stand in (`python -m benchmarks.decision_prior` makes them).

Letters: N samples, L quantiles.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

import numpy as np
from scipy.special import stdtrit

from core.evidence import Usual
from core.views import FloatArray

SHIPPED = Path(__file__).parent / "backbones" / "statistics" / "decision.json"
PRIOR_SAMPLES = 10.0
"""Own samples that weigh as much as all shipped ones."""
LOWER = 0.1587
"""Quantile one standard deviation below the median of a normal distribution."""
UNCERTAIN_FACTOR = 10.0
"""An object of no known category is answered `known` at the rate asked for, and `known` or `uncertain` at ten times that, until one looks
again."""
LEARN_FACTOR = 0.1
"""Evidence that an object of no known category reaches at a tenth of the rate lets a burst join: a false answer is over when it is given,
a false member misleads every later one."""
LARGEST_RATE = 0.5
"""Above it a threshold would lie below the median of what is wrong."""
LEAST_SPREAD = 1e-6
"""Where all samples are the same: a distribution without width has no odds."""
LARGEST_LOG_ODDS = 50.0
"""Beyond it a probability is 0 or 1 but for rounding, and its exponential would overflow at last."""


@dataclass(frozen=True)
class Samples:
    """Evidence of one kind: from tokens alone, or with poses."""

    rivals: tuple[float, ...]
    """Of the best wrong category."""
    own: tuple[float, ...]
    """Of the right category, by other instances of it."""

    @cached_property
    def location(self) -> float:
        """Median of the rivals."""
        return float(np.median(self.rivals))

    @cached_property
    def variance(self) -> float:
        """Of the rivals, unbiased."""
        return float(np.var(self.rivals, ddof=1))

    @cached_property
    def own_location(self) -> float:
        """Median evidence for the right category."""
        return float(np.median(self.own))


@dataclass(frozen=True)
class Prior:
    """What ships."""

    fingerprint: str
    """Of the backbone it was measured with; with another one it is a start, and no more."""
    usual: Usual
    """Matches with other categories, adapted to nothing."""
    agreement_weight: float
    """Evidence a unit of agreement of a pose is worth: such that both vary as much among wrong categories."""
    tokens: Samples
    """Of evidence from tokens alone."""
    verified: Samples
    """Of evidence with poses."""

    def of(self, verified: bool) -> Samples:
        """The samples of one kind of evidence."""
        return self.verified if verified else self.tokens

    @staticmethod
    @cache
    def shipped() -> Prior:
        """The estimate that comes with OneLook."""
        fields = json.loads(SHIPPED.read_text())
        kinds = {kind: Samples(tuple(fields[kind]["rivals"]), tuple(fields[kind]["own"])) for kind in ("tokens", "verified")}
        return Prior(fields["fingerprint"], Usual(**fields["usual"]), fields["agreement_weight"], kinds["tokens"], kinds["verified"])


@dataclass(frozen=True)
class Levels:
    """Evidence that a decision asks for."""

    known_above: float
    uncertain_above: float
    """Between it and the one above an object is uncertain."""
    learn_above: float
    """Above it a known burst joins its category."""


@dataclass(frozen=True)
class Calibration:
    """The evidence for the best wrong category as a Student distribution, and for the right one as a normal one of the same spread."""

    location: float
    """Median evidence for the best wrong category."""
    spread: float
    """Standard deviation of either, were they normal."""
    freedom: float
    """Degrees of freedom of the Student distribution."""
    own_location: float
    """Median evidence for the right category, of what ships."""

    @staticmethod
    def fit(rivals: Sequence[float], prior: Samples) -> Calibration:
        """From the memory's own rivals, of which there may be none, and the shipped samples.

        Location is the median of all, and the spread is about it: where the memory's own samples are elsewhere than what ships, it cannot
        yet be told which is right. Of what ships it is known which category is wrong, so both sides count; of the memory's own the lower
        side alone: an object that was called novel though its category is known counts among the rivals with too much evidence, and must
        not move the threshold.
        """
        shipped, own = np.asarray(prior.rivals), np.asarray(rivals, dtype=float)
        weights = np.concatenate([np.full(len(shipped), PRIOR_SAMPLES / len(shipped)), np.ones(len(own))])
        (middle,) = _quantiles(np.concatenate([shipped, own]), weights, (0.5,))
        squares = PRIOR_SAMPLES * (prior.variance + (prior.location - middle) ** 2)
        if len(own):
            low, own_middle = _quantiles(own, np.ones(len(own)), (LOWER, 0.5))
            squares += len(own) * ((own_middle - low) ** 2 + (own_middle - middle) ** 2)
        total = PRIOR_SAMPLES + len(own)
        return Calibration(middle, max(float(np.sqrt(squares / total)), LEAST_SPREAD), total - 1, prior.own_location)

    def threshold(self, rate: float) -> float:
        """What an object of no known category exceeds with this probability."""
        return self.location + self.spread * float(stdtrit(self.freedom, 1 - rate)) * float(np.sqrt(1 + 1 / (self.freedom + 1)))

    def levels(self, rate: float, looks: int = 0) -> Levels:
        """The thresholds of a rate.

        Each look that was taken for no other reason than doubt leaves less room for doubt, and none for what is more probably wrong.
        """
        uncertain_factor = UNCERTAIN_FACTOR ** (1 / (1 + looks))
        known, uncertain, learn = (self.threshold(min(factor * rate, LARGEST_RATE)) for factor in (1.0, uncertain_factor, LEARN_FACTOR))
        return Levels(known, min(max(uncertain, self.even), known) if looks else uncertain, learn)

    def probability(self, evidence: float) -> float:
        """That the most similar category is right, with even odds beforehand; grows with the evidence, since both distributions are
        taken for normal ones here."""
        log_odds_against = np.clip(-(evidence - self.even) * self._apart / self.spread**2, -LARGEST_LOG_ODDS, LARGEST_LOG_ODDS)
        return float(1 / (1 + np.exp(log_odds_against)))

    @property
    def even(self) -> float:
        """Evidence with which right and wrong are equally probable."""
        return self.location + self._apart / 2

    @property
    def _apart(self) -> float:
        return max(self.own_location - self.location, self.spread)


def _quantiles(values: FloatArray, weights: FloatArray, levels: Sequence[float]) -> FloatArray:
    """Of weighted samples, both shape (N,), at levels in [0, 1], shape (L,)."""
    order = np.argsort(values)
    cumulative = np.cumsum(weights[order]) - weights[order] / 2
    return np.asarray(np.interp(np.asarray(levels) * weights.sum(), cumulative, values[order]))
