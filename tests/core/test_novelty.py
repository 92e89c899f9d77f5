"""Known, uncertain or novel: by the paper's rule, and by ours."""

from __future__ import annotations

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest

from core.backbones.whitening import Whitening
from core.encode import EncodedBurst
from core.enrolled import Enrolled
from core.errors import InvalidInput
from core.evidence import PARTS, part_tokens, whitened
from core.novelty import VERIFIED, Context, Decision, DecisionConfig, Member, decide
from core.scores import BEST, SCORES

from .conftest import PaintedObject


def burst_of(painted: PaintedObject, tokens: np.ndarray) -> EncodedBurst:
    """One view for each token, shape (V, D)."""
    return painted.with_tokens(tokens[:, None])


def test_an_empty_memory_finds_everything_novel(painted: PaintedObject) -> None:
    decision = decide([], burst_of(painted, np.eye(2, 48)))
    assert decision.outcome == "novel"
    assert (decision.similarities, decision.similarity, decision.probability, decision.rival) == ((), None, None, None)


@pytest.mark.parametrize("score", sorted(SCORES))
def test_the_most_similar_category_is_chosen_above_the_threshold(score: str, painted: PaintedObject) -> None:
    kind, other = np.eye(2, 48), np.eye(48)[5:7]
    memory = [Member("kind", kind, kind), Member("other", other, other)]
    decision = decide(memory, burst_of(painted, kind), DecisionConfig(score))
    assert [category for category, _ in decision.similarities] == ["kind", "other"]
    between, own = decision.similarity - decision.margin / 2, decision.similarity
    assert decide(memory, burst_of(painted, kind), DecisionConfig(score, between)).outcome == "known"
    assert decide(memory, burst_of(painted, kind), DecisionConfig(score, own)).outcome == "novel"


@pytest.mark.parametrize("score", sorted(SCORES))
def test_categories_are_ranked_by_similarity_and_as_similar_ones_by_name(score: str, painted: PaintedObject) -> None:
    kind, other = np.eye(2, 48), np.eye(48)[5:7]
    memory = [Member("c", kind, kind), Member("a", other, other), Member("b", kind, kind)]
    decision = decide(memory, burst_of(painted, kind), DecisionConfig(score, 0.25))
    assert [category for category, _ in decision.similarities] == ["b", "c", "a"]
    assert (decision.score, decision.threshold, decision.uncertain_above, decision.learn_above) == (score, 0.25, 0.25, 0.25)


def test_best_ranks_as_similar_categories_by_name(painted: PaintedObject) -> None:
    memory = [replace(SIX_KINDS[0], category_id=name) for name in ("c", "b")]
    assert [category for category, _ in decide(memory, seen(painted, 0, 9)).similarities] == ["b", "c"]


@pytest.mark.parametrize("score", sorted(SCORES))
def test_enrolled_members_serve_best_alone(score: str, painted: PaintedObject) -> None:
    with pytest.raises(InvalidInput, match=f"^score: {score} compares whole members") as refused:
        decide(Enrolled(Mock(), None), burst_of(painted, np.eye(1, 48)), DecisionConfig(score))
    assert refused.value.field == "score"


def test_an_unknown_score_is_named(painted: PaintedObject) -> None:
    with pytest.raises(InvalidInput, match="paper_mean"):
        decide([], burst_of(painted, np.eye(1, 48)), DecisionConfig("nonsense"))


ROOM = np.random.default_rng(1).normal(size=(12, 384))
"""Directions of tokens, one a kind of thing."""


def kind_of_tokens(kind: int, seed: int, views: int = 4) -> np.ndarray:
    """Parts, shape (V, K, D), of an instance: its kind's tokens, somewhat its own, view by view."""
    rng = np.random.default_rng([kind, seed])
    own = ROOM[kind] + 0.2 * rng.normal(size=384)
    return own + 0.3 * rng.normal(size=(views, PARTS, 384))


def member(kind: int, seed: int) -> Member:
    tokens = kind_of_tokens(kind, seed)
    return Member(f"kind {kind}", tokens.mean(axis=1), tokens.mean(axis=1), tokens)


def seen(painted: PaintedObject, kind: int, seed: int, views: int = 4) -> EncodedBurst:
    return painted.with_tokens(kind_of_tokens(kind, seed, views))


SIX_KINDS = [member(kind, seed) for kind in range(6) for seed in range(2)]


def test_of_a_burst_the_memory_holds_its_tokens_and_those_of_its_parts(painted: PaintedObject) -> None:
    burst = seen(painted, 0, 0)
    held = Member.of("kind 0", burst)
    assert held.category_id == "kind 0"
    for kept, tokens in ((held.cls, burst.cls), (held.pooled, burst.pooled), (held.parts, part_tokens(burst))):
        assert np.array_equal(kept, tokens)


def test_best_knows_other_instances_and_finds_other_kinds_novel(painted: PaintedObject) -> None:
    known = [decide(SIX_KINDS, seen(painted, kind, 9)) for kind in range(6)]
    assert {decision.score for decision in known} == {BEST}
    assert [decision.outcome for decision in known] == ["known"] * 6
    assert [decision.similarities[0][0] for decision in known] == [f"kind {kind}" for kind in range(6)]
    assert {decide(SIX_KINDS, seen(painted, kind, 9)).outcome for kind in range(6, 12)} <= {"novel", "uncertain"}


def test_parts_are_compared_as_the_backbone_whitens_them(painted: PaintedObject) -> None:
    whitening = Whitening.fit(np.random.default_rng(2).normal(size=(500, 384)) * np.linspace(0.5, 2, 384) + 0.3)
    by_hand = [replace(each, parts=whitened(each.parts, whitening)) for each in SIX_KINDS]
    told = decide(SIX_KINDS, seen(painted, 2, 9), context=Context(whitening))
    asked = painted.with_tokens(whitened(kind_of_tokens(2, 9), whitening))
    assert told.similarity == pytest.approx(decide(by_hand, asked).similarity, abs=1e-3)
    assert told.similarity != pytest.approx(decide(SIX_KINDS, seen(painted, 2, 9)).similarity, abs=1e-3)


def test_evidence_does_not_depend_on_how_often_a_view_is_sent(painted: PaintedObject) -> None:
    burst = seen(painted, 2, 9)
    twice = EncodedBurst(burst.views + burst.views, "painted")
    once, again = decide(SIX_KINDS, burst), decide(SIX_KINDS, twice)
    # The same parts, and statistics that do not count views twice: only rounding differs.
    assert again.similarity == pytest.approx(once.similarity, abs=1e-5)


def test_poses_are_tried_of_the_likeliest_categories_alone_and_add_evidence(painted: PaintedObject) -> None:
    asked: list[str] = []

    def verify(category: str) -> float:
        asked.append(category)
        return 1.0 if category == "kind 2" else 0.0

    burst = seen(painted, 2, 9)
    plain, verified = decide(SIX_KINDS, burst), decide(SIX_KINDS, burst, context=Context(verify=verify))
    assert asked == [category for category, _ in plain.similarities[:VERIFIED]]
    assert (plain.verified, verified.verified) == (False, True)
    assert verified.similarity > plain.similarity
    assert verified.margin > plain.margin


PAST = Decision("novel", "best", 0.3, (), rival=0.6)


def test_what_earlier_bursts_came_near_to_raises_the_threshold(painted: PaintedObject) -> None:
    burst = seen(painted, 2, 9)
    assert decide(SIX_KINDS, burst, context=Context(past=[PAST] * 300)).threshold > decide(SIX_KINDS, burst).threshold + 0.1


@pytest.mark.parametrize("other", [replace(PAST, verified=True), replace(PAST, rival=None)])
def test_only_rivals_by_the_same_evidence_count(other: Decision, painted: PaintedObject) -> None:
    burst = seen(painted, 2, 9)
    assert decide(SIX_KINDS, burst, context=Context(past=[other] * 300)).threshold == decide(SIX_KINDS, burst).threshold


def test_with_poses_the_threshold_is_another_one(painted: PaintedObject) -> None:
    burst = seen(painted, 2, 9)
    assert decide(SIX_KINDS, burst, context=Context(verify=lambda category: 0.0)).threshold != decide(SIX_KINDS, burst).threshold


def test_a_stricter_rate_asks_for_more_and_learning_for_more_still(painted: PaintedObject) -> None:
    lax, strict = (decide(SIX_KINDS, seen(painted, 2, 9), DecisionConfig(false_known_rate=rate)) for rate in (0.05, 0.001))
    assert lax.uncertain_above < lax.threshold < lax.learn_above
    assert lax.threshold < strict.threshold
    assert lax.similarity == strict.similarity


def test_between_the_levels_the_answer_is_uncertain_and_names_candidates(painted: PaintedObject) -> None:
    burst = seen(painted, 2, 9)
    clear = decide(SIX_KINDS, burst)
    rates = np.geomspace(1e-9, 0.5, 20)
    outcomes = [decide(SIX_KINDS, burst, DecisionConfig(false_known_rate=rate)).outcome for rate in rates]
    assert outcomes == sorted(outcomes, key=["novel", "uncertain", "known"].index)
    assert {"uncertain", "known"} <= set(outcomes)
    unsure = decide(SIX_KINDS, burst, DecisionConfig(false_known_rate=rates[outcomes.index("uncertain")]))
    assert unsure.candidates[0] == clear.similarities[0][0] == "kind 2"


def test_every_further_look_leaves_less_room_for_doubt(painted: PaintedObject) -> None:
    asked = [decide(SIX_KINDS, seen(painted, 2, 9), DecisionConfig(looks=looks)) for looks in (0, 1, 2, 9)]
    levels = [decision.uncertain_above for decision in asked]
    assert levels == sorted(set(levels))
    assert levels[-1] < asked[0].threshold
    assert len({(decision.threshold, decision.learn_above, decision.similarity) for decision in asked}) == 1


def test_looks_that_cannot_be_are_refused() -> None:
    with pytest.raises(InvalidInput, match="looks: expected 0 or more views, found -1"):
        DecisionConfig(looks=-1)


@pytest.mark.parametrize(("share", "probable"), [(1.0, True), (0.65, False)])
def test_an_uncertain_object_counts_as_what_is_more_probable(share: float, probable: bool, painted: PaintedObject) -> None:
    burst = painted.with_tokens(share * kind_of_tokens(2, 9) + (1 - share) * kind_of_tokens(9, 9))
    asked = (decide(SIX_KINDS, burst, DecisionConfig(false_known_rate=rate)) for rate in np.geomspace(1e-9, 0.5, 20))
    unsure = next(decision for decision in asked if decision.outcome == "uncertain")
    assert (unsure.probability > 0.5) == probable
    assert (unsure.rival == unsure.similarity) == (not probable)


def test_the_rival_of_a_known_object_is_of_another_category(painted: PaintedObject) -> None:
    decision = decide(SIX_KINDS, seen(painted, 2, 9))
    assert decision.outcome == "known"
    # Without the right category none matches the burst well, so the best of the others stands out more than beside it.
    assert decision.similarities[1][1] < decision.rival < decision.similarities[0][1]


def test_a_threshold_of_the_callers_own_leaves_no_third_answer(painted: PaintedObject) -> None:
    decision = decide(SIX_KINDS, seen(painted, 2, 9), DecisionConfig(threshold=5.0))
    assert (decision.outcome, decision.threshold, decision.uncertain_above) == ("novel", 5.0, 5.0)


@pytest.mark.parametrize("rate", [0.0, 0.6, -1.0, float("nan")])
def test_an_impossible_rate_is_refused(rate: float) -> None:
    with pytest.raises(InvalidInput, match=f"^false_known_rate: expected a share above 0 and at most 0.5, found {rate}"):
        DecisionConfig(false_known_rate=rate)


def test_a_decision_that_was_right_keeps_the_rival_it_found_without_the_right_category(painted: PaintedObject) -> None:
    decision = decide(SIX_KINDS, seen(painted, 2, 9))
    assert decision.corrected("kind 2").rival == decision.rival > decision.similarities[1][1]


def test_a_corrected_decision_has_the_best_of_the_others_as_its_rival() -> None:
    decided = Decision("known", "best", 0.3, (("cup", 0.5), ("bowl", 0.4), ("vase", 0.1)), rival=0.4)
    assert [decided.corrected(said).rival for said in ("cup", "bowl", "a new one")] == [0.4, 0.5, 0.5]
    assert replace(decided, outcome="novel", rival=0.5).corrected("cup").rival == 0.4
    assert Decision("novel", "best", 0.3, ()).corrected("cup").rival is None
    assert replace(decided, score="paper_mean").corrected("cup").rival is None
