"""The ablation of the evidence: its arithmetic on a known table."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.evidence_ablation import Choice, row, varied
from benchmarks.matches import adapted, match_table
from benchmarks.pair_scores import nearest_accuracy
from core.evidence import PARTS, Adaptation


def test_one_choice_is_varied_at_a_time() -> None:
    choices = varied(40)
    today = choices["today's"]
    assert today == Choice(PARTS)
    for choice in list(choices.values())[1:]:
        changed = {name for name in ("parts", "drawn", "adapted", "deviations") if getattr(choice, name) != getattr(today, name)}
        assert len(changed) == 1 or changed == {"parts", "drawn"}


@pytest.mark.parametrize("deviations", [0, 3])
def test_a_hub_is_not_the_nearest_once_its_level_is_taken_off(deviations: float) -> None:
    matches = np.array([[1.0, 0.58, 0.3, 0.6], [0.58, 1.0, 0.3, 0.6], [0.3, 0.3, 1.0, 0.6], [0.6, 0.6, 0.6, 1.0]])
    labels = np.array([0, 0, 1, 2])
    assert nearest_accuracy(matches, labels) == 0
    found = row("it", matches, deviations, labels)
    assert (found["change"], found["nearest"]) == ("it", 1.0)


def test_tables_are_symmetric_and_adapted_to_what_is_asked() -> None:
    rng = np.random.default_rng(0)
    parts = [rng.normal(size=(2, 8, 6)).astype(np.float32) for _ in range(4)]
    table = match_table(parts, adapted(parts, 3))
    assert np.array_equal(table, table.T)
    assert np.allclose(np.diag(table), 1, atol=1e-5)
    assert not np.allclose(table, match_table(parts, adapted(parts, 0)), atol=1e-3)
    assert np.array_equal(adapted(parts, 0).matrix, Adaptation.none(6).matrix)
