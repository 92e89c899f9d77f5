"""The paper's f, over all pairs of views of a category and a burst ("Continual category learning").

Letters: F, G views of two bursts, D token size.
"""

from __future__ import annotations

from collections.abc import Mapping

from core.scores.base import Score
from core.views import FloatArray


def paper_sum(burst: FloatArray, target: FloatArray) -> float:
    """f as the paper writes it: the sum of cosines over all view pairs, from unit tokens (F, D), (G, D).

    It equals the dot product of the two sums, and grows with the number of views of either side.
    """
    return float(burst.sum(axis=0) @ target.sum(axis=0))


def paper_mean(burst: FloatArray, target: FloatArray) -> float:
    """`paper_sum` over the number of view pairs: a mean cosine, independent of how many views there are."""
    return paper_sum(burst, target) / (len(burst) * len(target))


OFFERS: Mapping[str, Score] = {
    "paper_sum": Score("cls", paper_sum, "sum", 80.0),
    "paper_mean": Score("cls", paper_mean, "mean", 0.8),
}
