"""The benchmark of the rendered world: what it says, not how fast it is."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks.rendering import run
from core.errors import InvalidInput


def test_a_row_an_object_and_their_mean(tmp_path: Path) -> None:
    run(tmp_path / "rendering.json", ["mug"], frames=1, seed=0)
    written = json.loads((tmp_path / "rendering.json").read_text())
    assert written["meta"]["size"] == [480, 640]
    assert [row["category"] for row in written["rows"]] == ["mug", "all"]
    assert all(row["fps"] == pytest.approx(1000 / row["frame_ms"]) for row in written["rows"])
    assert written["rows"][0]["triangles"] > 1000


def test_an_unknown_category_is_named() -> None:
    with pytest.raises(InvalidInput, match="unicorn"):
        run(None, ["unicorn"], frames=1, seed=0)
