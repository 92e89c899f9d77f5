"""Of many guesses those are kept that differ."""

from __future__ import annotations

import torch

from core.estimators.batched import Sim3Batch
from core.hypotheses import distinct
from core.sim3 import Sim3

from .conftest import turned


def test_the_better_of_two_alike_is_kept() -> None:
    guesses = Sim3Batch.of([turned(angle) for angle in (0, 5, 90, 180)])
    assert distinct(guesses, torch.tensor([0.4, 0.5, 0.1, 0.3]), 12, 3) == [1, 3, 2]


def test_a_twin_after_a_symmetry_of_the_reference_is_not_distinct(moved: Sim3) -> None:
    guesses = Sim3Batch.of([moved @ turned(angle) for angle in (0, 170, 90, 265, 45)])
    scores = torch.tensor([1.0, 0.9, 0.8, 0.7, 0.6])
    half_turn = turned(180).rotation[None]
    assert distinct(guesses, scores, 30, 5, half_turn) == [0, 2, 4]
    assert distinct(guesses, scores, 30, 5) == [0, 1, 2, 3, 4]
