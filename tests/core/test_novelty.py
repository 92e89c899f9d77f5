"""Known or novel by the paper's rule."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core.encode import EncodedBurst
from core.errors import InvalidInput
from core.novelty import SCORES, Member, best_view, decide, paper_mean, paper_sum
from core.sim3 import Sim3

from .conftest import PaintedObject

RNG = np.random.default_rng(0)


def burst_of(painted: PaintedObject, tokens: np.ndarray) -> EncodedBurst:
    view = painted.encode(1, Sim3.identity()).views[0]
    return EncodedBurst(tuple(replace(view, cls=token, pooled=token) for token in tokens.astype(np.float32)), "painted")


def test_the_sum_over_pairs_is_the_product_of_sums() -> None:
    first, second = RNG.normal(size=(3, 8)), RNG.normal(size=(4, 8))
    pairs = sum(float(a @ b) for a in first for b in second)
    assert np.isclose(paper_sum(first, second), pairs)
    assert np.isclose(paper_mean(first, second), pairs / 12)


def test_only_the_sum_grows_with_the_number_of_views() -> None:
    tokens = RNG.normal(size=(3, 8))
    doubled = np.concatenate([tokens, tokens])
    assert np.isclose(paper_sum(doubled, tokens), 2 * paper_sum(tokens, tokens))
    assert np.isclose(paper_mean(doubled, tokens), paper_mean(tokens, tokens))
    assert np.isclose(best_view(doubled, tokens), best_view(tokens, tokens))


def test_an_empty_memory_finds_everything_novel(painted: PaintedObject) -> None:
    decision = decide([], burst_of(painted, np.eye(2, 48)))
    assert decision.outcome == "novel"
    assert decision.similarities == ()


@pytest.mark.parametrize("score", sorted(SCORES))
def test_the_most_similar_category_is_chosen_above_the_threshold(score: str, painted: PaintedObject) -> None:
    kind, other = np.eye(2, 48), np.eye(48)[5:7]
    memory = [Member("kind", kind, kind), Member("other", other, other)]
    known = decide(memory, burst_of(painted, kind), score=score, threshold=0.1)
    assert known.outcome == "known"
    assert known.similarities[0][0] == "kind"
    assert decide(memory, burst_of(painted, kind), score=score, threshold=1e9).outcome == "novel"


def test_all_bursts_of_a_category_count_as_one_set(painted: PaintedObject) -> None:
    first, second = np.eye(1, 48), np.eye(48)[1:2]
    memory = [Member("kind", first, first), Member("kind", second, second)]
    similarities = decide(memory, burst_of(painted, first), score="paper_sum").similarities
    assert similarities == (("kind", 1.0),)


def test_an_unknown_score_is_named(painted: PaintedObject) -> None:
    with pytest.raises(InvalidInput, match="paper_mean"):
        decide([], burst_of(painted, np.eye(1, 48)), score="nonsense")
