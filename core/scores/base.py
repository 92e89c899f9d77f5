"""What a score is: tokens that the memory keeps of every burst, the similarity of two bursts by them, and what that makes of a category.

A file beside this one offers a score by the name that `ONELOOK_SCORE` and `onelook bench discovery --score` call it:
`OFFERS: Mapping[str, Score] = {"name": Score(…)}`. tests/core/test_scores.py and the other tests that read SCORES try all that are offered;
what is its own goes into a test_NAME.py beside it. What needs parts or poses is no score but evidence: `core.evidence`.

Letters: F, G views of two bursts, D token size.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from core.descriptors import unit
from core.views import FloatArray

Aggregation = Literal["sum", "mean", "max"]


class Tokens(Protocol):
    """What is kept of every burst: an instance of the memory (`core.novelty.Member`), or the burst that is asked about."""

    @property
    def cls(self) -> FloatArray:
        """[CLS] of each view, shape (F, D)."""

    @property
    def pooled(self) -> FloatArray:
        """Mean foreground token of each view, whitened where the backbone has statistics, shape (F, D)."""


@dataclass(frozen=True)
class Score:
    """How similar a burst is to a category."""

    token: Literal["cls", "pooled"]
    """Of `Tokens`, what is compared."""
    similarity: Callable[[FloatArray, FloatArray], float]
    """Of two bursts, from unit tokens, shapes (F, D), (G, D): the more alike, the larger."""
    aggregation: Aggregation
    """Over the bursts of a category; the mean counts each by its number of views."""
    threshold: float
    """Above it a burst is known, where nobody says otherwise."""

    def tokens(self, burst: Tokens) -> FloatArray:
        """What `similarity` takes of a burst, shape (F, D)."""
        tokens: FloatArray = getattr(burst, self.token)
        return unit(tokens)

    def of_category(self, bursts: Sequence[FloatArray], target: FloatArray) -> float:
        """Similarity of a category's bursts, each shape (F, D), at least one, to a burst, shape (G, D)."""
        each = [self.similarity(burst, target) for burst in bursts]
        if self.aggregation == "max":
            return max(each)
        if self.aggregation == "sum":
            return sum(each)
        return float(np.average(each, weights=[len(burst) for burst in bursts]))
