"""Similarities of sets from parts of pairs, against the decision's own."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.pair_scores import PairScores, auroc, hardest
from core.novelty import DecisionConfig, Member, decide
from core.scores import SCORES


@pytest.fixture
def bursts() -> list[SimpleNamespace]:
    """Five bursts of different numbers of views, with random tokens."""
    rng = np.random.default_rng(1)
    return [SimpleNamespace(cls=rng.normal(size=(views, 8)), pooled=rng.normal(size=(views, 8))) for views in (3, 5, 1, 4, 2)]


@pytest.mark.parametrize("score", sorted(SCORES))
def test_a_set_is_as_similar_as_the_service_says(bursts: list[SimpleNamespace], score: str) -> None:
    pairs, members, target = PairScores.of(bursts, SCORES[score]), [0, 1, 3], 4
    memory = [Member("it", bursts[index].cls, bursts[index].pooled) for index in members]
    ((_, expected),) = decide(memory, bursts[target], DecisionConfig(score)).similarities
    part = np.full((), pairs.none)
    for member in members:
        part = pairs.joined(part, pairs.part[member, target])
    assert pairs.similarity(part, pairs.views[members].sum()) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("score", sorted(SCORES))
def test_a_single_burst_is_as_similar_as_the_service_says(bursts: list[SimpleNamespace], score: str) -> None:
    single = PairScores.of(bursts, SCORES[score]).single()
    memory = [Member(str(index), burst.cls, burst.pooled) for index, burst in enumerate(bursts)]
    for target, burst in enumerate(bursts):
        for name, expected in decide(memory, burst, DecisionConfig(score)).similarities:
            assert single[int(name), target] == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize(
    ("positive", "negative", "expected"), [([3, 4], [1, 2], 1.0), ([1], [1], 0.5), ([1, 3], [2], 0.5), ([0], [1, 2], 0.0)]
)
def test_auroc_is_the_share_of_pairs_in_order_and_half_of_ties(positive: list[float], negative: list[float], expected: float) -> None:
    assert auroc(np.array(positive), np.array(negative)) == expected


def test_the_hardest_burst_is_the_one_that_leads_least() -> None:
    labels = np.array([0, 0, 1, 1, 2])
    single = np.array(
        [
            [9.0, 0.8, 0.1, 0.2, 0.7],
            [0.8, 9.0, 0.6, 0.1, 0.1],
            [0.1, 0.6, 9.0, 0.4, 0.1],
            [0.2, 0.1, 0.4, 9.0, 0.1],
            [0.7, 0.1, 0.1, 0.1, 9.0],  # alone of its kind: nothing can lead
        ]
    )
    assert hardest(single, labels) == 2
