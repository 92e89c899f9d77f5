"""The tables of pairs say what the service would."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from benchmarks import calibrated
from benchmarks.best_pairs import BestPairs, BestSource
from benchmarks.matches import STAGES
from benchmarks.thresholds import threshold_grid
from core.calibration import Prior, Samples
from core.evidence import Comparison, Entry, Usual, match_views

PRIOR = Prior("any", Usual(0.2, 0.05), 0.5, Samples((-0.2, -0.1, 0.0), (0.2,)), Samples((-0.1, 0.0, 0.1), (0.4,)))
LABELS = np.repeat(np.arange(6), 3)
CHOSEN = [0, 0, 1, 2, 2, 3, 1, 4, 5, 6, 6]
"""The category that each of the first bursts joined, in the order in which they came."""


@pytest.fixture
def patches() -> list[torch.Tensor]:
    """Eighteen bursts, three of a kind, of different numbers of views."""
    generator = torch.Generator().manual_seed(0)
    kinds = torch.randn(6, 32, generator=generator)
    noise = [torch.randn(1 + index % 4, 5, 32, generator=generator) for index in range(len(LABELS))]
    return [torch.nn.functional.normalize(kinds[label] + each, dim=-1) for label, each in zip(LABELS, noise)]


@pytest.fixture
def pairs(patches: list[torch.Tensor]) -> BestPairs:
    """Of these bursts, with the same matches at every stage."""
    match = np.stack([match_views(each, patches) for each in patches])
    agreement = np.random.default_rng(0).uniform(0, 0.3, match.shape)
    np.fill_diagonal(agreement, np.nan)
    return BestPairs(np.stack([match] * len(STAGES)), agreement, PRIOR)


def filled(source: BestSource) -> np.ndarray:
    """Fills one memory with the categories of CHOSEN; returns the number of them, shape (1,)."""
    source.begin(1)
    for burst, category in enumerate(CHOSEN):
        source.learn(burst, np.array([category]), np.array([0]))
    return np.array([max(CHOSEN) + 1])


@pytest.mark.parametrize("target", [11, 14, 17])
@pytest.mark.parametrize("without", [-1, 2])
def test_evidence_is_the_service_s(pairs: BestPairs, patches: list[torch.Tensor], target: int, without: int) -> None:
    source = BestSource(BestPairs(pairs.match, None, PRIOR), room=10)
    used = filled(source)
    categories, evidence = source.ranked(target, used, np.array([without]))
    entries = [Entry(str(category), patches[burst]) for burst, category in enumerate(CHOSEN)]
    expected = Comparison.between(patches[target], entries, PRIOR.usual).ranked(str(without) if without >= 0 else None)
    assert [str(each) for each in categories[0]] == [category for category, _ in expected]
    np.testing.assert_allclose(evidence[0], [value for _, value in expected], atol=1e-5)


def test_no_memory_gives_more_evidence_than_the_most(pairs: BestPairs) -> None:
    grid = threshold_grid("best", pairs, pairs.single(), 0.3)
    most, few = -np.inf, BestSource(pairs, room=10)
    used = filled(few)
    for target in range(len(LABELS)):
        most = max(most, few.ranked(target, used, np.array([-1]))[1].max())
    assert pairs.single().max() < most < grid[-1]


def test_a_burst_can_be_left_out(pairs: BestPairs) -> None:
    fewer = pairs.without(4)
    kept = [index for index in range(len(LABELS)) if index != 4]
    assert np.array_equal(fewer.match, pairs.match[:, kept][:, :, kept])
    assert np.array_equal(fewer.agreement, pairs.agreement[kept][:, kept], equal_nan=True)


def test_poses_count_for_the_three_with_the_most_evidence_by_their_founders(pairs: BestPairs) -> None:
    alone, verified = BestSource(BestPairs(pairs.match, None, PRIOR), 10), BestSource(pairs, 10)
    used = filled(alone)
    filled(verified)
    before, after = (dict(zip(*(each[0].tolist() for each in source.ranked(12, used, np.array([-1]))))) for source in (alone, verified))
    shortlist = sorted(before, key=lambda category: -before[category])[:3]
    assert sorted(verified.tried[0].tolist()) == sorted(shortlist)
    for category in before:
        founder = CHOSEN.index(category)
        gained = PRIOR.agreement_weight * pairs.agreements()[founder, 12] if category in shortlist else 0
        assert after[category] == pytest.approx(before[category] + gained)


def test_calibrated_episodes_know_kinds_apart_and_count_what_they_met(pairs: BestPairs) -> None:
    order = np.random.default_rng(1).permutation(len(LABELS)).tolist()
    answers = calibrated.episode(BestPairs(pairs.match, None, PRIOR), LABELS, order, (0.01, 0.2))
    assert (answers.unknown + answers.holding).tolist() == [[17, 17]]
    assert (answers.false_known <= answers.unknown).all()
    assert (answers.missed + answers.mistaken + answers.holding_uncertain <= answers.holding).all()
    assert (answers.new <= answers.unknown).all()
    assert (answers.new_false_known <= np.minimum(answers.new, answers.false_known)).all()
    assert answers.missed[0, 1] <= answers.missed[0, 0] < answers.holding[0, 0]
    twice = answers + answers
    assert twice.unknown.shape == (2, 2)
