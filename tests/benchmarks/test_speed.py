"""The speed table's arithmetic, and that it runs."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest

from benchmarks import speed
from core.errors import InvalidInput
from core.pose import VARIANTS

run = partial(speed.run, rounds=1, backbone="colour", device="cpu")


def test_rows_are_medians_and_their_ratio_to_an_observation() -> None:
    times = [{"look": {"total": ms}, "solve": {"match": 1.0, "total": 5.0}} for ms in (1.0, 15.0, 100.0)]
    rows = {(row.operation, row.stage): (row.ms, row.ratio) for row in speed.table_rows(times, ("look", "solve"))}
    assert rows == {("look", "total"): (15, 0.75), ("solve", "match"): (1, 0.05), ("solve", "total"): (5, 0.25)}


def test_every_stage_is_timed_and_drawn(recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, backbone) -> None:
    monkeypatch.setattr(speed, "load_backbone", lambda name, device, dtype=None: backbone)
    monkeypatch.setattr(speed, "WARM_UP", 0)
    rows = run(None, recorded, views=2, plot=tmp_path / "speed.png")
    totals = {row.operation for row in rows if row.stage == "total"}
    assert {"encode", "learn", "decide best, 3 poses", *(f"solve {variant}" for variant in VARIANTS)} <= totals
    assert sum(row.ratio for row in rows if row.stage == "total" and row.operation in speed.OBSERVATION) == pytest.approx(1)
    assert (tmp_path / "speed.png").stat().st_size > 10_000


def test_two_objects_with_enough_views_are_needed(recorded: Path) -> None:
    with pytest.raises(InvalidInput, match="two objects of 5 or more views"):
        run(None, recorded, views=5, plot=None)


def test_bounds_are_compared_with_ratios_of_the_same_run() -> None:
    ms = {
        "encode": 40.0,
        speed.STRAIGHTFORWARD: 100.0,
        speed.BARE: 25.0,
        speed.NEAR: 30.0,
        "solve ucd": 6.0,
        speed.PRODUCTS: 2.0,
        speed.RECIPE: 60.0,
        "solve best": 90.0,
        "solve ucd, 3 times the views": 12.0,
        "solve best, 3 times the views": 135.0,
    }
    rows = [speed.SpeedRow(name, "total", each, 0.0) for name, each in ms.items()] + [speed.SpeedRow("complete depth", "alone", 4.5, 0.0)]
    assert [row.measured for row in speed.target_rows(rows, 2.5)] == [0.4, 0.25, 0.3, 3.0, 10.0, 90.0, 2.0, 1.5, 4.5, 2.5]
