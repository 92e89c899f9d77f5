"""How likely a hypothesis of the variant `best` is right: a probability that its rotation is within 30° of the truth.

A logistic model of what the estimator knows without truth. Its coefficients ship; `python -m benchmarks.pose_confidence` makes them, from
recordings with true poses, and shows on others how often what is said to be likely is so.

Letters: T hypotheses, X evidence.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import expit

from core.views import FloatArray

SHIPPED = Path(__file__).parent / "backbones" / "statistics" / "confidence.json"
CLEAR_MARGIN = 1.0
"""Largest log ratio of scores that counts; also that of a hypothesis without a rival."""
PENALTY = 1e-2
"""Of squared coefficients, which keeps them finite where the samples are perfectly told apart."""


def evidence(scores: FloatArray, target_views: int) -> FloatArray:
    """What speaks for each hypothesis, shape (T, X = 4), given the scores of hypotheses that differ, shape (T,), positive.

    A constant, the log ratio of its score and its best rival's, the log of its score, and the log of the number of target views.
    """
    log = np.log(np.maximum(scores, 1e-9))
    rivals = np.array([np.delete(log, index).max(initial=-np.inf) for index in range(len(log))])
    margins = np.clip(log - rivals, -CLEAR_MARGIN, CLEAR_MARGIN)
    return np.stack([np.ones_like(log), margins, log, np.full_like(log, np.log(target_views))], axis=1)


@dataclass(frozen=True)
class Confidence:
    """Coefficients of the model, for one backbone."""

    fingerprint: str
    """Of the backbone whose scores it was fitted to; another's scores lie elsewhere."""
    coefficients: tuple[float, ...]
    """X of them."""

    @staticmethod
    def fit(fingerprint: str, evidence: FloatArray, right: NDArray[np.bool_]) -> Confidence:
        """From hypotheses, shape (T, X), and whether each was right, shape (T,): the most likely coefficients, with a slight penalty."""

        def loss(coefficients: FloatArray) -> float:
            log_odds = evidence @ coefficients
            return float(np.logaddexp(0, np.where(right, -log_odds, log_odds)).mean() + PENALTY * (coefficients[1:] ** 2).mean())

        found = minimize(loss, np.zeros(evidence.shape[1]), method="BFGS").x
        return Confidence(fingerprint, tuple(round(float(value), 4) for value in found))

    @staticmethod
    @cache
    def shipped() -> Confidence:
        """The model that comes with OneLook."""
        fields = json.loads(SHIPPED.read_text())
        return Confidence(fields["fingerprint"], tuple(fields["coefficients"]))

    def probability(self, evidence: FloatArray) -> FloatArray:
        """Of each hypothesis, shape (T,) from (T, X)."""
        return np.asarray(expit(evidence @ np.array(self.coefficients)))


def probabilities(scores: FloatArray, target_views: int, fingerprint: str) -> list[float | None]:
    """Of hypotheses that differ, given their scores, shape (T,), best first, by the shipped model; None for each of another backbone's."""
    model = Confidence.shipped()
    if model.fingerprint != fingerprint:
        return [None] * len(scores)
    return [float(each) for each in model.probability(evidence(scores, target_views))]
