"""Every part of `best` is left out once, and the truth picks among its hypotheses last."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks import ablation
from benchmarks.ablation import CHANGES, ORACLE
from core.errors import InvalidInput


def test_every_change_has_a_row_and_nothing_beats_the_truths_own_choice(recorded: Path, tmp_path: Path, small_world: Any) -> None:
    small_world(ablation)
    rows = {row.change: row for row in ablation.run(recorded, ["4"], 1, tmp_path / "ablation.json", 0, "colour")}
    assert list(rows) == list(CHANGES)
    assert rows["best"].acc30 == 100
    assert rows[ORACLE].median_deg <= rows["best"].median_deg + 1e-3
    assert len(json.loads((tmp_path / "ablation.json").read_text())["rows"]) == len(CHANGES)


def test_more_views_than_were_recorded_are_refused(recorded: Path, small_world: Any) -> None:
    small_world(ablation)
    with pytest.raises(InvalidInput, match="5 were asked for"):
        ablation.run(recorded, ["5"], 1, None, 0, "colour")
