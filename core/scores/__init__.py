"""Scores by name: how similar a burst is to a category. To add one, add a file here that offers a `Score` (`core.scores.base`)."""

from __future__ import annotations

from core.errors import InvalidInput
from core.offers import Offers
from core.scores.base import Score

BEST = "best"
"""Ours is none of SCORES: it is evidence from parts and poses (`core.evidence`), whose threshold comes from a rate."""
DEFAULT_SCORE = BEST
SCORES: Offers[Score] = Offers(__name__)


def require_score(name: str) -> None:
    """Raises InvalidInput for the name of no score."""
    if name != BEST and name not in SCORES:
        raise InvalidInput("score", f"{name!r} is none of {', '.join((BEST, *SCORES))}")
