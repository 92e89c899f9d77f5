"""The benchmark of the next view: what it counts, and that it runs."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from benchmarks import next_view
from benchmarks.next_view import Case, summary, verdict
from clients.simulator.raycast.world import RaycastWorld
from core.errors import InvalidInput
from core.novelty import Decision

run = partial(next_view.run, instances=1, looks=1, rate=0.04, seed=0, backbone="colour")


def decision(outcome: str) -> Decision:
    return Decision(outcome, "best", 0.4, (("mug", 0.5),))


@pytest.mark.parametrize(
    ("outcome", "category", "held", "expected"),
    [
        ("known", "mug", True, "right"),
        ("known", "pan", True, "wrong"),
        ("novel", "pan", False, "right"),
        ("novel", "mug", True, "wrong"),
        ("uncertain", "mug", True, "uncertain"),
    ],
)
def test_an_answer_is_right_where_the_memory_could_know(outcome: str, category: str, held: bool, expected: str) -> None:
    assert verdict(decision(outcome), category, held) == expected


def test_only_uncertain_cases_are_looked_at_again() -> None:
    cases = [
        Case("mug", True, "right"),
        Case("pan", True, "uncertain", "right", ("right", "uncertain", "wrong", "wrong")),
        Case("bear", False, "uncertain", "wrong", ("right",) * 4),
    ]
    first, offered, random = summary(cases)
    assert (first["cases"], first["still_uncertain"]) == (3, pytest.approx(200 / 3))
    assert (offered["cases"], offered["settled_rightly"], offered["settled_wrongly"]) == (2, 50, 50)
    assert (random["views_tried"], random["settled_rightly"], random["settled_wrongly"], random["still_uncertain"]) == (8, 62.5, 25, 12.5)


def test_every_object_is_met_by_either_half(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, backbone) -> None:
    monkeypatch.setattr(next_view, "load_backbone", lambda name: backbone)
    monkeypatch.setattr(RaycastWorld, "capture", RaycastWorld.capture_with_mask)  # this backbone finds no object by itself
    monkeypatch.setattr(next_view, "SCANNED", 3)
    monkeypatch.setattr(next_view, "map_jobs", lambda function, jobs, weight, description: [function(job) for job in jobs])
    run(tmp_path / "found.json", ["mug", "bear"])
    rows = json.loads((tmp_path / "found.json").read_text())["rows"]
    assert [row["next_view"] for row in rows[:3]] == ["none", "offered", "random"]
    assert sorted((row["category"], row["held"]) for row in rows[3:]) == [("bear", False), ("bear", True), ("mug", False), ("mug", True)]
    assert np.isclose(sum(rows[0][key] for key in ("settled_rightly", "settled_wrongly", "still_uncertain")), 100)


def test_an_unknown_category_is_named() -> None:
    with pytest.raises(InvalidInput, match="unicorn"):
        run(None, ["unicorn", "mug"])
