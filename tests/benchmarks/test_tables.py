"""The JSON that other programs read."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from benchmarks.tables import machine, print_table, write_json


def test_what_does_not_exist_is_null(tmp_path: Path) -> None:
    file = tmp_path / "new" / "out.json"
    write_json(file, {"data": Path("some/folder"), "limit": None}, [{"median_t": np.inf, "acc30": np.float64(75), "pairs": np.int64(4)}])
    assert json.loads(file.read_text()) == {
        "meta": {"data": "some/folder", "limit": None},
        "rows": [{"median_t": None, "acc30": 75.0, "pairs": 4}],
    }


def test_the_machine_is_described() -> None:
    assert {"onelook", "torch", "processor", "cores"} <= machine().keys()


def test_a_table_for_people(capsys) -> None:
    print_table("Pose", [{"category": "cup", "median_t": float("inf"), "acc30": 97.25}], ["category", "acc30", "median_t"])
    printed = capsys.readouterr().out
    assert "cup" in printed
    assert "97.2" in printed
    assert "–" in printed
