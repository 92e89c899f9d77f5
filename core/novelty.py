"""Known, uncertain or novel: a burst against every category (paper, "Continual category learning", and ours).

Letters: V views, K parts of a view, D token size.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from core.backbones.whitening import Whitening
from core.calibration import LARGEST_RATE, Calibration, Levels, Prior
from core.encode import EncodedBurst
from core.enrolled import Enrolled
from core.errors import InvalidInput
from core.evidence import Adaptation, Comparison, Entry, Usual, part_tokens, whitened
from core.scores import BEST, DEFAULT_SCORE, SCORES, require_score
from core.views import FloatArray

Outcome = Literal["known", "uncertain", "novel"]
Verify = Callable[[str], float]
"""How well the best pose of a category's reference explains the burst (`core.verification`), 0 where there is none."""

VERIFIED = 3
"""Categories whose poses are tried, those with the most evidence first."""


@dataclass(frozen=True, eq=False)
class Member:
    """The tokens of one burst that was assigned to a category."""

    category_id: str
    cls: FloatArray
    """[CLS] of each view, shape (V, D)."""
    pooled: FloatArray
    """Mean foreground token of each view, whitened where the backbone has statistics, shape (V, D)."""
    parts: FloatArray | None = None
    """Of `core.evidence.part_tokens`, shape (V, K, D)."""

    @classmethod
    def of(cls, category_id: str, burst: EncodedBurst) -> Member:
        """What the memory holds of a burst that was assigned to a category."""
        return cls(category_id, burst.cls, burst.pooled, part_tokens(burst))


@dataclass(frozen=True)
class DecisionConfig:
    """How to decide."""

    score: str = DEFAULT_SCORE
    threshold: float | None = None
    """Similarity above which an object is known, and else novel, with no third answer; None leaves it to the rate, or to a paper score's
    own default."""
    false_known_rate: float = 0.01
    """Share of the objects of no known category that may be called known; of score `best`."""
    looks: int = 0
    """Views taken for no other reason than that the object was uncertain: with each there is less room for doubt. What is still not known
    from where it should differ most is the more likely novel, so the lower level rises; the upper one, which the rate is about, stays."""

    def __post_init__(self) -> None:
        require_score(self.score)
        if not 0 < self.false_known_rate <= LARGEST_RATE:
            raise InvalidInput("false_known_rate", f"expected a share above 0 and at most {LARGEST_RATE}, found {self.false_known_rate}")
        if self.looks < 0:
            raise InvalidInput("looks", f"expected 0 or more views, found {self.looks}")


@dataclass(frozen=True, eq=False)
class Decision:
    """What a burst is taken for, and why."""

    outcome: Outcome
    score: str
    threshold: float
    """Above it a burst is known."""
    similarities: tuple[tuple[str, float], ...]
    """(category id, similarity), most similar first; with score `best` of the few best matching ones."""
    uncertain_above: float = 0.0
    """Between it and the threshold a burst is uncertain. Both are equal where there is no third answer."""
    learn_above: float = 0.0
    """Above it a known burst joins its category."""
    probability: float | None = None
    """Estimated, that the most similar category is right, at even odds beforehand."""
    verified: bool = False
    """Whether poses took part, of up to VERIFIED categories."""
    rival: float | None = None
    """Similarity of the best wrong category, as far as the decision tells which is wrong: what later thresholds are made of.
    Of an uncertain one what is more probable counts: leaving these out would leave out the most similar of unknown objects."""

    @property
    def similarity(self) -> float | None:
        """Of the most similar category; None of an empty memory."""
        return self.similarities[0][1] if self.similarities else None

    @property
    def margin(self) -> float | None:
        """By how much the most similar category leads; None where there is no other."""
        return self.similarities[0][1] - self.similarities[1][1] if len(self.similarities) > 1 else None

    @property
    def candidates(self) -> tuple[str, ...]:
        """Categories that an uncertain burst may be of: those that no clear answer rules out."""
        return tuple(category for category, similarity in self.similarities if similarity > self.uncertain_above)

    def corrected(self, category_id: str) -> Decision:
        """With the best of the other categories for its rival, now that the burst is known to be of this one; a paper score has none.

        What was found without this category stays. Else the others count as they were ranked, this one among them: its match with the
        burst is part of their cohort, so the rival is somewhat smaller than one that was found without it.
        """
        if self.score != BEST:
            return replace(self, rival=None)
        if self.similarities and self.similarities[0][0] == category_id and self.rival not in (None, self.similarity):
            return self
        return replace(self, rival=max((similarity for category, similarity in self.similarities if category != category_id), default=None))


@dataclass(frozen=True, eq=False)
class Context:
    """What `best` knows beside the memory and the burst."""

    whitening: Whitening | None = None
    """The backbone's."""
    past: Sequence[Decision] = ()
    """Earlier decisions of this memory, which calibrate it."""
    verify: Verify | None = None
    """Where the burst has depth and cameras."""


def decide(
    memory: Sequence[Member] | Enrolled, target: EncodedBurst, config: DecisionConfig | None = None, context: Context | None = None
) -> Decision:
    """The most similar category if it is similar enough; uncertain where that cannot be told; else novel.

    An empty memory finds everything novel. Members without parts are no part of `best`; enrolled ones serve no other score, and bring
    their own whitening.
    """
    config = config or DecisionConfig()
    if config.score == BEST:
        return _by_evidence(memory, target, config, context or Context())
    if isinstance(memory, Enrolled):
        raise InvalidInput("score", f"{config.score} compares whole members, which are not enrolled; give it the members themselves")
    score = SCORES[config.score]
    limit = score.threshold if config.threshold is None else config.threshold
    tokens: dict[str, list[FloatArray]] = {}
    for member in memory:
        tokens.setdefault(member.category_id, []).append(score.tokens(member))
    asked = score.tokens(target)
    similarities = {category: score.of_category(bursts, asked) for category, bursts in tokens.items()}
    ranked = tuple(sorted(similarities.items(), key=lambda entry: (-entry[1], entry[0])))
    known = bool(ranked) and ranked[0][1] > limit
    return Decision("known" if known else "novel", config.score, limit, ranked, limit, limit)


def _by_evidence(memory: Sequence[Member] | Enrolled, target: EncodedBurst, config: DecisionConfig, context: Context) -> Decision:
    prior, verified = Prior.shipped(), context.verify is not None
    comparison = _compare(memory, target, context.whitening, prior.usual)
    evidence = comparison.ranked() if comparison else []
    agreements = {category: context.verify(category) for category, _ in evidence[:VERIFIED]} if context.verify else {}

    def weighed(ranked: Sequence[tuple[str, float]]) -> tuple[tuple[str, float], ...]:
        kept = [(category, value + prior.agreement_weight * agreements.get(category, 0.0)) for category, value in ranked]
        return tuple(sorted(kept, key=lambda entry: (-entry[1], entry[0])))

    similarities = weighed(evidence)
    rivals = [each.rival for each in context.past if each.rival is not None and (each.score, each.verified) == (BEST, verified)]
    calibration = Calibration.fit(rivals, prior.of(verified))
    levels = calibration.levels(config.false_known_rate, config.looks) if config.threshold is None else Levels(*(config.threshold,) * 3)
    best = similarities[0][1] if similarities else -np.inf
    outcome: Outcome = "known" if best > levels.known_above else "uncertain" if best > levels.uncertain_above else "novel"
    likely = outcome == "known" or (outcome == "uncertain" and best > calibration.even)
    wrong = weighed(comparison.ranked(without=similarities[0][0])) if likely and comparison else similarities
    return Decision(
        outcome,
        config.score,
        levels.known_above,
        similarities,
        levels.uncertain_above,
        levels.learn_above,
        calibration.probability(best) if similarities else None,
        verified,
        wrong[0][1] if wrong else None,
    )


def _compare(memory: Sequence[Member] | Enrolled, target: EncodedBurst, whitening: Whitening | None, usual: Usual) -> Comparison | None:
    if isinstance(memory, Enrolled):
        return memory.compare(target, usual)
    members = [(member.category_id, whitened(member.parts, whitening)) for member in memory if member.parts is not None]
    if not members:
        return None
    adaptation = Adaptation.fit([parts for _, parts in members])
    entries = [Entry(category_id, adaptation.directions(parts)) for category_id, parts in members]
    return Comparison.between(adaptation.directions(whitened(part_tokens(target), whitening)), entries, usual)
