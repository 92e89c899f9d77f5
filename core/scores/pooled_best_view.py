"""Mean foreground tokens, each view by the other burst's most similar one (ours).

Letters: F, G views of two bursts, D token size.
"""

from __future__ import annotations

from collections.abc import Mapping

from core.scores.base import Score
from core.views import FloatArray


def best_view(burst: FloatArray, target: FloatArray) -> float:
    """Mean over views of the cosine to the other burst's most similar view, both directions, from unit tokens (F, D), (G, D).

    Opposite sides of one object look unalike; averaging over them, as the paper's f does, hides a good match.
    """
    cosines = burst @ target.T
    return float((cosines.max(axis=0).mean() + cosines.max(axis=1).mean()) / 2)


OFFERS: Mapping[str, Score] = {"pooled_best_view": Score("pooled", best_view, "max", 0.4)}
