"""Thresholds of samples drawn from distributions whose quantiles are known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm, t

from core.calibration import PRIOR_SAMPLES, Calibration, Prior, Samples

PRIOR = Samples(tuple(np.random.default_rng(1).normal(0.5, 0.3, 20)), (2.0, 2.5))


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)


@pytest.mark.parametrize("rate", [0.01, 0.05])
def test_many_samples_of_its_own_give_the_quantile_asked_for(rate: float, rng: np.random.Generator) -> None:
    rivals = rng.normal(0.1, 0.05, 20_000)
    threshold = Calibration.fit(rivals, PRIOR).threshold(rate)
    assert rate / 2 < (rng.normal(0.1, 0.05, 200_000) > threshold).mean() < rate * 2


def test_few_samples_leave_the_prior_and_are_more_careful() -> None:
    none, some = Calibration.fit([], PRIOR), Calibration.fit([0.1] * 5, PRIOR)
    assert none.location == pytest.approx(np.median(PRIOR.rivals))
    assert 0.1 <= some.location < none.location
    # Of one more from a normal distribution of which so many are known.
    predicted = t.ppf(0.99, PRIOR_SAMPLES - 1) * np.sqrt(1 + 1 / PRIOR_SAMPLES)
    assert none.threshold(0.01) == pytest.approx(none.location + predicted * none.spread)


def test_of_what_ships_the_upper_side_counts_too() -> None:
    skewed = Samples((0.0, 0.0, 0.0, 0.1, 0.5), PRIOR.own)
    assert Calibration.fit([], skewed).spread == pytest.approx(np.std(skewed.rivals, ddof=1))


@pytest.mark.parametrize("count", [10, 30, 100])
def test_a_memory_where_all_is_more_alike_than_what_ships_keeps_the_rate(count: int, rng: np.random.Generator) -> None:
    prior = Samples(tuple(norm.ppf((np.arange(20) + 0.5) / 20)), PRIOR.own)
    thresholds = [Calibration.fit(rng.normal(2, 1, count), prior).threshold(0.01) for _ in range(200)]
    assert np.mean(norm.sf(np.array(thresholds) - 2)) < 0.02


def test_objects_falsely_called_novel_hardly_move_the_threshold(rng: np.random.Generator) -> None:
    rivals = rng.normal(0.1, 0.05, 300)
    clean = Calibration.fit(rivals, PRIOR)
    mixed = Calibration.fit(np.concatenate([rivals, rng.normal(0.6, 0.1, 60)]), PRIOR)
    assert mixed.threshold(0.01) - clean.threshold(0.01) < clean.spread


def test_probability_grows_with_the_evidence_and_is_even_in_the_middle(rng: np.random.Generator) -> None:
    calibration = Calibration.fit(rng.normal(0.1, 0.05, 300), PRIOR)
    levels = [calibration.probability(evidence) for evidence in np.linspace(-1, 3, 50)]
    assert levels == sorted(levels)
    assert levels[0] < 0.01
    assert levels[-1] > 0.99
    assert calibration.probability((calibration.location + calibration.own_location) / 2) == pytest.approx(0.5)


def test_what_ships_puts_other_instances_above_other_categories() -> None:
    prior = Prior.shipped()
    for samples in (prior.tokens, prior.verified):
        assert np.median(samples.own) > np.quantile(samples.rivals, 0.75)
    assert prior.agreement_weight > 0


def test_one_rate_makes_three_levels_and_a_look_narrows_the_room_for_doubt() -> None:
    calibration = Calibration.fit([], Samples(PRIOR.rivals, (0.6,)))
    asked, looked = calibration.levels(0.02), calibration.levels(0.02, looks=1)
    assert asked.known_above == calibration.threshold(0.02)
    assert (asked.uncertain_above, asked.learn_above) == (calibration.threshold(0.2), calibration.threshold(0.002))
    assert looked.uncertain_above == calibration.threshold(0.02 * np.sqrt(10))
    assert asked.uncertain_above < looked.uncertain_above < looked.known_above == asked.known_above


def test_after_a_look_nothing_is_uncertain_that_is_more_probably_wrong() -> None:
    calibration = Calibration.fit([], Samples(PRIOR.rivals, (1.4,)))
    asked, looked = calibration.levels(0.02), calibration.levels(0.02, looks=1)
    assert calibration.probability(asked.uncertain_above) < 0.5
    assert asked.uncertain_above < looked.uncertain_above == calibration.even < looked.known_above == asked.known_above


def test_where_the_threshold_is_more_probably_wrong_a_look_leaves_no_doubt() -> None:
    calibration = Calibration.fit([], Samples(PRIOR.rivals, (2.25,)))
    asked, looked = calibration.levels(0.02), calibration.levels(0.02, looks=1)
    assert calibration.probability(asked.known_above) < 0.5
    assert looked.uncertain_above == looked.known_above == asked.known_above


def test_doubt_ends_at_the_median_of_what_is_wrong() -> None:
    calibration = Calibration.fit([], PRIOR)
    assert calibration.levels(0.3).uncertain_above == pytest.approx(calibration.location)
