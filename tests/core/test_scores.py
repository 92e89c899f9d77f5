"""What holds of every score, and known answers of those that ship."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest

from core.errors import InvalidInput
from core.scores import BEST, SCORES, require_score
from core.scores.base import Score
from core.scores.paper import paper_mean, paper_sum
from core.scores.pooled_best_view import best_view


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)


@pytest.fixture(params=sorted(SCORES))
def score(request: pytest.FixtureRequest) -> Score:
    return SCORES[request.param]


def tokens_of(score: Score, views: np.ndarray) -> np.ndarray:
    """What the score takes of a burst whose tokens of either sort are `views`, shape (F, D)."""
    return score.tokens(SimpleNamespace(cls=views, pooled=views))


def bursts_of(score: Score, *views: int) -> list[np.ndarray]:
    """Bursts of so many views each, the same whenever asked."""
    rng = np.random.default_rng(1)
    return [tokens_of(score, rng.normal(size=(count, 8))) for count in views]


def test_only_the_token_that_is_named_counts_and_only_its_direction(score: Score, rng: np.random.Generator) -> None:
    views, other = rng.normal(size=(3, 8)), np.zeros((3, 8))
    named = SimpleNamespace(**({"cls": other, "pooled": other} | {score.token: views}))
    assert np.allclose(score.tokens(named), views / np.linalg.norm(views, axis=1, keepdims=True))


def test_a_burst_is_more_like_itself_than_like_one_turned_away(score: Score) -> None:
    (burst,) = bursts_of(score, 4)
    assert score.similarity(burst, burst) > score.similarity(burst, -burst)


@pytest.mark.parametrize(("own", "asked"), [(1, 1), (1, 5), (7, 2)])
def test_any_number_of_views_has_a_similarity(score: Score, own: int, asked: int) -> None:
    burst, target = bursts_of(score, own, asked)
    assert np.isfinite(score.similarity(burst, target))


def test_a_category_of_one_burst_is_as_similar_as_that(score: Score) -> None:
    burst, target = bursts_of(score, 3, 5)
    assert score.of_category([burst], target) == pytest.approx(score.similarity(burst, target))


def test_the_order_in_which_a_category_learnt_changes_nothing(score: Score) -> None:
    *bursts, target = bursts_of(score, 3, 1, 4, 2)
    assert score.of_category(bursts[::-1], target) == pytest.approx(score.of_category(bursts, target))


def test_by_its_own_threshold_ten_views_alike_are_known_and_ten_that_share_nothing_are_not(score: Score) -> None:
    alike, other = (tokens_of(score, np.tile(direction, (10, 1))) for direction in np.eye(2, 8))
    assert score.of_category([alike], other) < score.threshold < score.of_category([alike], alike)


def test_the_sum_over_pairs_is_the_product_of_sums(rng: np.random.Generator) -> None:
    first, second = rng.normal(size=(3, 8)), rng.normal(size=(4, 8))
    pairs = sum(float(a @ b) for a in first for b in second)
    assert np.isclose(paper_sum(first, second), pairs)
    assert np.isclose(paper_mean(first, second), pairs / 12)


def test_only_the_sum_grows_with_the_number_of_views(rng: np.random.Generator) -> None:
    tokens = rng.normal(size=(3, 8))
    doubled = np.concatenate([tokens, tokens])
    assert np.isclose(paper_sum(doubled, tokens), 2 * paper_sum(tokens, tokens))
    assert np.isclose(paper_mean(doubled, tokens), paper_mean(tokens, tokens))
    assert np.isclose(best_view(doubled, tokens), best_view(tokens, tokens))


def test_each_view_is_compared_with_its_most_similar_one_by_hand() -> None:
    burst, target = np.eye(2), np.array([[1.0, 0], [0.6, 0.8], [0, -1]])
    of_the_target, of_the_burst = (1 + 0.8 + 0) / 3, (1 + 0.8) / 2
    assert best_view(burst, target) == pytest.approx((of_the_target + of_the_burst) / 2)


@pytest.mark.parametrize(("name", "similarity"), [("paper_sum", paper_sum), ("paper_mean", paper_mean)])
def test_the_paper_takes_all_views_of_a_category_as_one_set(name: str, similarity: Callable[[np.ndarray, np.ndarray], float]) -> None:
    *bursts, target = bursts_of(SCORES[name], 3, 1, 4, 2)
    assert SCORES[name].of_category(bursts, target) == pytest.approx(similarity(np.concatenate(bursts), target))


def test_the_most_similar_burst_speaks_for_its_category() -> None:
    score = SCORES["pooled_best_view"]
    *bursts, target = bursts_of(score, 3, 1, 4, 2)
    assert score.of_category(bursts, target) == max(best_view(burst, target) for burst in bursts)


def test_an_unknown_score_is_answered_with_all_there_are() -> None:
    with pytest.raises(InvalidInput, match=f"^score: 'nonsense' is none of {', '.join((BEST, *SCORES))}$"):
        require_score("nonsense")
