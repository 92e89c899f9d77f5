"""The paper's tables: every published row is there, and ours stands beside the right one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks import paper, pose
from benchmarks.contenders import Sweep
from benchmarks.paper import PUBLISHED, SWEEPS, beside
from core.errors import InvalidInput


def test_every_row_of_ours_that_a_published_one_names_is_run() -> None:
    run = {(setting.contender.variant, setting.views.text, setting.contender.dims) for sweep in SWEEPS for setting in sweep.settings(384)}
    assert {each.ours for each in PUBLISHED if each.ours} <= run


def test_without_measurements_the_published_figures_stand_alone() -> None:
    rows = beside([])
    assert len(rows) == len(PUBLISHED)
    assert {row.acc30 for row in rows} == {None}
    ucd = next(row for row in rows if row.method == "Ours-UCD")
    assert (ucd.paper_median_deg, ucd.paper_acc30, ucd.paper_acc15, ucd.paper_acc7_5) == (26.2, 64.5, 49.4, 29.2)


def test_both_tables_from_one_run(recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, small_world: Any) -> None:
    small_world(pose)
    sweeps = [Sweep(["ucd"], ["4"], dims=[32, 24])]
    monkeypatch.setattr(paper, "SWEEPS", sweeps)
    monkeypatch.setattr(paper, "PUBLISHED", (paper.Published(1, "Ours-UCD", 10, 32, 26.2, 64.5, 49.4, 29.2, ("ucd", "4", 32)),))
    first, second = paper.run(recorded, 1, tmp_path / "paper.json", seed=0, backbone="colour")
    assert (first.method, first.paper_acc30, first.variant, first.dims, first.acc30) == ("Ours-UCD", 64.5, "ucd", 32, 100)
    assert (second.method, second.paper_acc30, second.dims, second.acc30) == ("not published", None, 24, 100)
    written = json.loads((tmp_path / "paper.json").read_text())
    assert (written["meta"]["benchmark"], len(written["rows"])) == ("paper", 2)


def test_ten_views_are_needed(recorded: Path, small_world: Any) -> None:
    small_world(pose)
    with pytest.raises(InvalidInput, match="10 were asked for"):
        paper.run(recorded, 1, None, seed=0, backbone="colour")
