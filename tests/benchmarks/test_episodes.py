"""False positives and negatives of similarity matrices made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.discovery import score_rows
from benchmarks.episodes import MOST_SEQUENCES, Counts, SetSource, draw_orders, nearest_category
from benchmarks.episodes import episode as run_episode
from benchmarks.pair_scores import PairScores

LABELS = np.array([0, 0, 1, 1])
TWO_KINDS = np.array(
    [
        [1.0, 0.8, 0.3, 0.1],
        [0.8, 1.0, 0.2, 0.1],
        [0.3, 0.2, 1.0, 0.6],
        [0.1, 0.1, 0.6, 1.0],
    ]
)
"""Bursts 0 and 1 are of one kind, 2 and 3 of another; no pair of different kinds is as similar as a pair of one."""
CURVE = np.array([-1.0, 0.2, 0.3, 0.5, 0.7, 0.9])


def pairs_of(similarity: np.ndarray) -> PairScores:
    """Bursts of one view each, whose mean cosines are `similarity`."""
    return PairScores("mean", np.ones(len(similarity), dtype=int), similarity)


def episode(pairs: PairScores, labels: np.ndarray, order: list[int], thresholds: np.ndarray) -> Counts:
    return run_episode(SetSource(pairs, len(order)), labels, order, thresholds)


def test_a_threshold_between_the_kinds_makes_no_error() -> None:
    counts = episode(pairs_of(TWO_KINDS), LABELS, [0, 1, 2, 3], CURVE)
    assert (counts.presented.tolist(), counts.seen.tolist()) == ([4], [2])
    # At 0.2, burst 2 joins the first kind at the mean 0.25, and 3 joins all three at (0.1 + 0.1 + 0.6) / 3.
    assert counts.false_positive.tolist() == [[2, 2, 0, 0, 0, 0]]
    assert counts.false_negative.tolist() == [[0, 0, 0, 0, 1, 2]]
    assert counts.fp.tolist() == [50, 50, 0, 0, 0, 0]
    assert counts.fn.tolist() == [0, 0, 0, 0, 50, 100]


def test_a_category_is_compared_by_the_mean_over_its_members() -> None:
    # Burst 2 has 0.3 to burst 0 and 0.2 to burst 1.
    counts = episode(pairs_of(TWO_KINDS), LABELS, [0, 1, 2], np.array([0.24, 0.26]))
    assert counts.false_positive.tolist() == [[1, 0]]


def test_the_nearest_category_is_asked_of_a_memory_that_holds_all_others() -> None:
    # The last is the only one of its kind, and is not asked.
    similarity = np.array([[1, 0.8, 0.7, 0], [0.8, 1, 0.1, 0], [0.7, 0.1, 1, 0], [0, 0, 0, 1.0]])
    labels = np.array([0, 0, 0, 1])
    assert nearest_category(SetSource(pairs_of(similarity), 2), labels) == 1
    assert nearest_category(SetSource(pairs_of(TWO_KINDS), 2), LABELS) == 1
    swapped = np.array([0, 1, 0, 1])
    assert nearest_category(SetSource(pairs_of(TWO_KINDS), 2), swapped) == 0


def test_joining_the_majority_is_right_even_in_a_mixed_category() -> None:
    everything_alike = np.full((4, 4), 0.5)
    counts = episode(pairs_of(everything_alike), np.array([0, 1, 1, 1]), [0, 1, 2, 3], np.array([0.4]))
    # 1 joins 0's category: wrong. 2 finds one member of each kind, a tie, and 3 a majority of its own: right.
    assert counts.false_positive.tolist() == [[1]]
    assert counts.false_negative.tolist() == [[0]]


def test_a_category_founded_twice_is_known_by_either() -> None:
    # Burst 1 is falsely novel; burst 0 again goes to its own founder, which is a repeat and not counted.
    counts = episode(pairs_of(TWO_KINDS), LABELS, [0, 1, 0, 1], np.array([0.9]))
    assert (counts.presented.sum(), counts.seen.sum(), counts.false_negative.sum(), counts.false_positive.sum()) == (2, 1, 1, 0)


def test_counts_add_up() -> None:
    once = episode(pairs_of(TWO_KINDS), LABELS, [0, 1, 2, 3], CURVE)
    twice = once + once
    assert (twice.presented.tolist(), twice.seen.tolist()) == ([4, 4], [2, 2])
    np.testing.assert_array_equal(twice.fn, once.fn)


def test_repeats_are_counted_apart() -> None:
    counts = episode(pairs_of(TWO_KINDS), LABELS, [0, 0, 1, 0], np.array([0.5, 2.0]))
    assert (counts.presented.tolist(), counts.repeats.tolist()) == ([2], [2])
    assert counts.repeat_errors.tolist() == [[0, 2]]  # nothing exceeds 2, not even a burst's similarity to itself


def test_a_similarity_of_the_threshold_itself_is_not_above_it_however_often_a_burst_was_met() -> None:
    tenth = float(np.float32(0.1))  # three of them in single precision are more than three tenths
    alike = np.where(TWO_KINDS == 0.1, tenth, TWO_KINDS)
    counts = episode(pairs_of(alike), LABELS, [0, 0, 0, 3], np.array([tenth]))
    assert counts.categories.tolist() == [[1, 1, 1, 2]]


def test_the_memory_s_growth_stands_beside_the_truth() -> None:
    counts = episode(pairs_of(TWO_KINDS), LABELS, [0, 1, 2, 3], np.array([0.5, 0.9]))
    assert counts.categories.tolist() == [[1, 1, 2, 2], [1, 2, 3, 4]]
    assert counts.truth.tolist() == [1, 1, 2, 2]


def test_bands_are_quantiles_over_episodes() -> None:
    best, worst = (episode(pairs_of(TWO_KINDS), LABELS, [0, 1, 2, 3], np.array([threshold])) for threshold in (0.5, 0.9))
    _, fn = (best + worst).bands(0.0, 1.0)
    assert fn[:, 0].tolist() == [0, 100]


def test_orders_are_seeded_and_of_ten_sequences_a_category() -> None:
    labels = np.repeat([0, 1], [5, 30])
    orders = draw_orders(3, labels, length=400, seed=1)
    assert orders == draw_orders(3, labels, length=400, seed=1) != draw_orders(3, labels, length=400, seed=2)
    for order in orders:
        assert {burst for burst in order if burst < 5} == set(range(5))
        assert len({burst for burst in order if burst >= 5}) == MOST_SEQUENCES


@pytest.fixture
def two_kinds_of_rows() -> list[dict[str, object]]:
    """The table of three episodes over TWO_KINDS."""
    return [dict(row) for row in score_rows("paper_mean", pairs_of(TWO_KINDS), LABELS, draw_orders(3, LABELS, 12, seed=0))]


def test_separable_kinds_have_a_perfect_summary(two_kinds_of_rows: list[dict[str, object]]) -> None:
    *curve, summary = two_kinds_of_rows
    assert (summary["auroc"], summary["nearest"], summary["fn_at_zero_fp"], summary["fn_at_one_fp"]) == (1, 1, 0, 0)
    assert all(set(row) == {"score", "threshold", "fp", "fn", "fp_band", "fn_band", "repeat_error"} for row in curve)
    thresholds = [row["threshold"] for row in curve]
    assert thresholds == sorted(thresholds)
    assert (curve[-1]["fp"], curve[-1]["fn"]) == (0, 100)


def test_inseparable_kinds_have_none() -> None:
    alike = np.full((4, 4), 0.5) + 0.5 * np.eye(4)
    summary = score_rows("paper_mean", pairs_of(alike), LABELS, draw_orders(3, LABELS, 12, seed=0))[-1]
    assert (summary["auroc"], summary["fn_at_zero_fp"]) == (0.5, 100)
