"""The continual setting from folders to rows, and which scores it is run for."""

from __future__ import annotations

import json
import shutil
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks import discovery
from benchmarks.calibrated import RATES
from benchmarks.discovery import EASIER, TOKENS, pair_tables
from core.errors import InvalidInput
from core.scores import BEST, SCORES
from core.scores.base import Score

run = partial(discovery.run, seed=0, backbone="colour", poses=True)


def test_a_score_that_does_not_exist_is_refused_before_any_data_are_read(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="'nonsense' is none of"):
        run(tmp_path / "missing", ["paper_sum", "nonsense"], None, episodes=1, length=1, picture=None)


def test_every_score_has_a_curve_and_a_summary_and_best_a_row_for_each_rate(two_kinds: Path, tmp_path: Path, small_world: Any) -> None:
    small_world(discovery)
    file, picture = tmp_path / "discovery.json", tmp_path / "discovery.png"
    rows = run(two_kinds, [], file, episodes=2, length=6, picture=picture)
    summaries = [row for row in rows if "auroc" in row]
    assert [row["score"] for row in summaries] == [*SCORES, BEST, TOKENS, EASIER]
    assert {row["score"] for row in rows if "threshold" in row} == {row["score"] for row in summaries}
    assert [(row["score"], row["asked_percent"]) for row in rows if "asked_percent" in row] == [
        (name, 100 * rate) for name in (BEST, EASIER) for rate in RATES
    ]
    written = json.loads(file.read_text())
    assert len(written["rows"]) == len(rows)
    assert written["meta"]["hardest"] in {"egg/large", "egg/small", "plate/a", "plate/b"}
    assert picture.stat().st_size > 10_000


def test_two_objects_of_one_kind_and_one_of_another_are_enough(two_kinds: Path, small_world: Any) -> None:
    small_world(discovery)
    shutil.rmtree(two_kinds / "plate" / "b")
    rows = run(two_kinds, [BEST], None, episodes=2, length=4, picture=None)
    assert [row["score"] for row in rows if "auroc" in row] == [BEST, TOKENS]


@pytest.mark.parametrize("asked", [[], ["added"], [BEST, "added"]])
def test_a_score_that_was_added_has_a_table_as_all_others(asked: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    added = Score("cls", lambda burst, target: float((burst @ target.T).max()), "max", 0.5)
    monkeypatch.setattr("benchmarks.discovery.SCORES", {**SCORES, "added": added})
    bursts = [SimpleNamespace(cls=np.eye(8)[row : row + 2], pooled=np.eye(8)[:2]) for row in (0, 1, 4)]
    tables = pair_tables(bursts, asked)
    assert set(tables) == ({"added"} if asked else {*SCORES, "added"})
    assert tables["added"].single().tolist() == [[1, 1, 0], [1, 1, 0], [0, 0, 1]]
