"""Which scores the continual setting is run for."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.discovery import pair_tables, run
from core.errors import InvalidInput
from core.scores import BEST, SCORES
from core.scores.base import Score


def test_a_score_that_does_not_exist_is_refused_before_any_data_are_read(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="'nonsense' is none of"):
        run(
            tmp_path / "missing",
            ["paper_sum", "nonsense"],
            None,
            episodes=1,
            length=1,
            seed=0,
            backbone="colour",
            picture=None,
            poses=True,
        )


@pytest.mark.parametrize("asked", [[], ["added"], [BEST, "added"]])
def test_a_score_that_was_added_has_a_table_as_all_others(asked: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    added = Score("cls", lambda burst, target: float((burst @ target.T).max()), "max", 0.5)
    monkeypatch.setattr("benchmarks.discovery.SCORES", {**SCORES, "added": added})
    bursts = [SimpleNamespace(cls=np.eye(8)[row : row + 2], pooled=np.eye(8)[:2]) for row in (0, 1, 4)]
    tables = pair_tables(bursts, asked)
    assert set(tables) == ({"added"} if asked else {*SCORES, "added"})
    assert tables["added"].single().tolist() == [[1, 1, 0], [1, 1, 0], [0, 0, 1]]
