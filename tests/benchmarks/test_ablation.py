"""Every part of `best` is left out once, and the truth picks among its hypotheses last."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from benchmarks import ablation
from benchmarks.ablation import CHANGES, ORACLE


def test_every_change_has_a_row_and_nothing_beats_the_truths_own_choice(recorded: Path, tmp_path: Path, small_world: Any) -> None:
    small_world(ablation)
    rows = {row.change: row for row in ablation.run(recorded, ["4"], 1, tmp_path / "ablation.json", 0, "colour")}
    assert list(rows) == list(CHANGES)
    assert rows["best"].acc30 == 100
    assert rows[ORACLE].median_deg <= rows["best"].median_deg + 1e-3
    assert len(json.loads((tmp_path / "ablation.json").read_text())["rows"]) == len(CHANGES)
