"""A confidence grows with what speaks for a pose, and is kept where it was fitted."""

from __future__ import annotations

import numpy as np
import pytest

from core.confidence import CLEAR_MARGIN, Confidence, evidence, probabilities


def test_margins_are_to_the_best_rival_and_bounded() -> None:
    margins = evidence(np.array([0.4, 0.2, 0.1]), 5)[:, 1]
    assert margins == pytest.approx([np.log(2), -np.log(2), -CLEAR_MARGIN])


def test_a_hypothesis_without_rival_has_the_largest_margin() -> None:
    assert evidence(np.array([0.3]), 5)[0, 1] == CLEAR_MARGIN


def test_a_score_of_zero_is_finite() -> None:
    assert np.isfinite(evidence(np.array([0.0, 0.0]), 1)).all()


def test_a_fit_gives_back_how_often_hypotheses_are_right() -> None:
    rng = np.random.default_rng(0)
    rows = evidence(rng.uniform(0.05, 0.6, 4000), 5)
    rows[:, 1] = rng.uniform(-1, 1, len(rows))
    truth = 1 / (1 + np.exp(-(0.5 + 4 * rows[:, 1])))
    model = Confidence.fit("colour-1", rows, rng.random(len(rows)) < truth)
    assert np.abs(model.probability(rows) - truth).mean() < 0.05


def test_samples_that_are_perfectly_told_apart_give_finite_coefficients() -> None:
    rows = evidence(np.geomspace(0.6, 0.01, 40), 5)
    model = Confidence.fit("colour-1", rows, rows[:, 2] > -2)
    assert np.isfinite(model.coefficients).all()
    assert model.probability(rows[:1])[0] > 0.9


def test_the_shipped_model_trusts_a_clear_winner_more_and_its_rival_less() -> None:
    fingerprint = Confidence.shipped().fingerprint
    clear, close = (probabilities(np.array(scores), 5, fingerprint) for scores in ([0.4, 0.1], [0.4, 0.39]))
    assert clear[0] is not None
    assert close[0] is not None
    assert clear[1] is not None
    assert clear[0] > close[0] > clear[1]


def test_another_backbone_has_no_confidence() -> None:
    assert probabilities(np.array([0.4, 0.1]), 5, "another") == [None, None]
