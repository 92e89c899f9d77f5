"""Known or novel: similarity of a burst to every category, against a threshold (paper, "Continual category learning").

Letters: F views of a category over all its bursts, G views of the target, D token size.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from core.descriptors import unit
from core.encode import EncodedBurst
from core.errors import InvalidInput

FloatArray = NDArray[np.floating]


@dataclass(frozen=True, eq=False)
class Member:
    """The tokens of one burst that was assigned to a category."""

    category_id: str
    cls: FloatArray
    """[CLS] of each view, shape (V, D)."""
    pooled: FloatArray
    """Mean foreground token of each view, whitened where the backbone has statistics, shape (V, D)."""


@dataclass(frozen=True, eq=False)
class Decision:
    """What a burst is taken for, and why."""

    outcome: Literal["known", "uncertain", "novel"]
    score: str
    threshold: float
    similarities: tuple[tuple[str, float], ...]
    """(category id, similarity), most similar first."""


def paper_sum(category: FloatArray, target: FloatArray) -> float:
    """f as the paper writes it: the sum of cosines over all view pairs, from unit tokens (F, D), (G, D).

    It equals the dot product of the two sums, and grows with the number of views of either side.
    """
    return float(category.sum(axis=0) @ target.sum(axis=0))


def paper_mean(category: FloatArray, target: FloatArray) -> float:
    """`paper_sum` over the number of view pairs: a mean cosine, independent of how many views there are."""
    return paper_sum(category, target) / (len(category) * len(target))


def best_view(burst: FloatArray, target: FloatArray) -> float:
    """Mean over views of the cosine to the other burst's most similar view, both directions, from unit tokens (F, D), (G, D).

    Opposite sides of one object look unalike; averaging over them, as the paper's f does, hides a good match.
    """
    cosines = burst @ target.T
    return float((cosines.max(axis=0).mean() + cosines.max(axis=1).mean()) / 2)


@dataclass(frozen=True)
class Score:
    """A named similarity of token sets."""

    token: Literal["cls", "pooled"]
    similarity: Callable[[FloatArray, FloatArray], float]
    over: Literal["views", "bursts"]
    """`views`: a category is one set of tokens, as in the paper. `bursts`: it is as similar as its most similar burst."""
    threshold: float
    """Above it a burst is known."""


SCORES = {
    "paper_sum": Score("cls", paper_sum, "views", 80.0),
    "paper_mean": Score("cls", paper_mean, "views", 0.8),
    "pooled_best_view": Score("pooled", best_view, "bursts", 0.4),
}
DEFAULT_SCORE = "pooled_best_view"


def named_score(name: str) -> Score:
    """A score by name. Raises InvalidInput for an unknown one."""
    if name not in SCORES:
        raise InvalidInput("score", f"{name!r} is none of {', '.join(SCORES)}")
    return SCORES[name]


def decide(memory: Sequence[Member], target: EncodedBurst, *, score: str = DEFAULT_SCORE, threshold: float | None = None) -> Decision:
    """The most similar category if it is similar enough; else novel. An empty memory finds everything novel."""
    named = named_score(score)
    limit = named.threshold if threshold is None else threshold
    tokens: dict[str, list[FloatArray]] = {}
    for member in memory:
        tokens.setdefault(member.category_id, []).append(getattr(member, named.token))
    asked = unit(getattr(target, named.token))
    similarities = {category: _similarity(named, [unit(each) for each in bursts], asked) for category, bursts in tokens.items()}
    ranked = tuple(sorted(similarities.items(), key=lambda entry: (-entry[1], entry[0])))
    known = bool(ranked) and ranked[0][1] > limit
    return Decision("known" if known else "novel", score, limit, ranked)


def _similarity(score: Score, bursts: Sequence[FloatArray], target: FloatArray) -> float:
    if score.over == "views":
        return score.similarity(np.concatenate(bursts), target)
    return max(score.similarity(burst, target) for burst in bursts)
