"""The JSON that other programs read."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from benchmarks.tables import print_table, write_json


def test_what_does_not_exist_is_null(tmp_path: Path) -> None:
    file = tmp_path / "new" / "out.json"
    write_json(file, {"data": Path("some/folder"), "limit": None}, [{"median_t": np.inf, "acc30": np.float64(75), "pairs": np.int64(4)}])
    written = json.loads(file.read_text())
    assert written["rows"] == [{"median_t": None, "acc30": 75.0, "pairs": 4}]
    assert (written["meta"]["data"], written["meta"]["limit"]) == ("some/folder", None)


def test_the_machine_is_described(tmp_path: Path) -> None:
    write_json(tmp_path / "out.json", {}, [])
    assert {"onelook", "torch", "processor", "cores"} <= json.loads((tmp_path / "out.json").read_text())["meta"].keys()


def test_a_table_for_people(capsys) -> None:
    print_table("Pose, [new]/data", [{"category": "cup [a]", "median_t": float("inf"), "acc30": 97.25}], ["category", "acc30", "median_t"])
    printed = capsys.readouterr().out
    assert "cup [a]" in printed
    assert "Pose, [new]/data" in printed
    assert "97.2" in printed
    assert "–" in printed
