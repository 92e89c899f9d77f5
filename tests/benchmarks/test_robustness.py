"""The robustness benchmark from folders to figures, on ellipsoids."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from benchmarks import clean_memory, robustness
from benchmarks.clean_memory import Decisions
from benchmarks.degradations.catalogue import catalogue
from benchmarks.robustness import CLEAN, Outcome, breaks_at, figures, table_rows
from clients.pose_error import NO_POSE, PoseError
from core.errors import InvalidInput, NoObject

from .conftest import travelled

KNOWN = Decisions(own=2.0, rival=1.0, right=True, nearest=True, uncertain=False, novel=False, false_known=False)
MISSED = Decisions(own=0.0, rival=1.0, right=False, nearest=False, uncertain=False, novel=True, false_known=True)
run = partial(robustness.run, views="3", limit=None, degradations=[], categories=[], strongest=None, seed=0, backbone="colour", poses=True)


@pytest.fixture(autouse=True)
def small(small_world, monkeypatch: pytest.MonkeyPatch, backbone) -> None:
    small_world(robustness)
    monkeypatch.setattr(robustness, "backbone_named", lambda name: backbone)


def only(monkeypatch: pytest.MonkeyPatch, **strengths: tuple[float, ...]) -> list[str]:
    """Leaves only these strengths of these degradations to be tried, and gives their names."""
    named = {name.replace("_", " "): each for name, each in strengths.items()}
    short = [replace(each, strengths=named[each.name]) for each in catalogue([]) if each.name in named]
    monkeypatch.setattr(robustness, "catalogue", lambda things: short)
    return list(named)


def test_a_mild_degradation_does_no_harm_and_a_hopeless_one_does(two_kinds: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = only(monkeypatch, depth_noise=(5,), camera_turn=(90,))
    file = tmp_path / "robustness.json"
    rows = run(two_kinds, file, tmp_path / "plot", limit=1, degradations=names)
    clean, noisy, turned, *breaks = rows
    assert (clean["degradation"], clean["acc30"]) == (CLEAN, 100)
    assert noisy["acc30"] == 100
    assert turned["acc30"] < 100
    assert {(row["bursts"], row["pairs"]) for row in (clean, noisy, turned)} == {(2, 2)}
    assert [row["acc30_breaks_at"] is None for row in breaks] == [True, False]
    assert json.loads(file.read_text())["meta"]["views"] == "3"
    assert (tmp_path / "plot" / "robustness.png").stat().st_size > 10_000


def test_what_is_done_is_not_done_again(two_kinds: Path, backbone, monkeypatch: pytest.MonkeyPatch) -> None:
    names = only(monkeypatch, motion_blur=(2,))
    first = run(two_kinds, None, None, limit=1, degradations=names)
    calls = backbone.calls
    monkeypatch.delattr(clean_memory, "_lay")
    assert run(two_kinds, None, None, limit=1, degradations=names) == first
    assert backbone.calls == calls


def test_a_job_and_its_outcomes_can_travel_between_processes(two_kinds: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = only(monkeypatch, jpeg=(50,))
    here = run(two_kinds, None, None, limit=1, degradations=names, poses=False)
    monkeypatch.setattr(robustness, "map_jobs", travelled)
    assert run(two_kinds, None, None, limit=1, degradations=names, poses=False) == here


def test_where_no_object_is_found_there_is_no_pose_and_no_answer(two_kinds: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(*_: object) -> Path:
        raise NoObject("views", "all black")

    names = only(monkeypatch, jpeg=(50,))
    monkeypatch.setattr(robustness, "encode_degraded", nothing)
    clean, *_ = run(two_kinds, None, None, limit=1, degradations=names)
    shares = ("acc30", "right", "uncertain", "novel", "nearest", "false_known")
    assert [clean[name] for name in shares] == [0] * len(shares)
    assert clean["median_deg"] == 180


def test_a_smaller_limit_takes_a_prefix(two_kinds: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(robustness, "table_rows", lambda *_: [])

    def targets(limit: int | None) -> list[str]:
        seen: list[str] = []

        def work(job: Any) -> list[Outcome]:
            seen.append(job.recordings.sequences[job.target].name)
            return [Outcome(CLEAN, 0, (NO_POSE,), KNOWN)]

        monkeypatch.setattr(robustness, "work", work)
        run(two_kinds, None, None, limit=limit, degradations=["depth noise"])
        return seen

    assert targets(1) == targets(None)[:2]
    assert sorted(targets(None)) == ["egg/large", "egg/small", "plate/a", "plate/b"]


def test_targets_may_be_of_some_categories_and_strengths_the_last_ones(two_kinds: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = only(monkeypatch, jpeg=(50, 5))
    rows = run(two_kinds, None, None, degradations=names, categories=["plate"], strongest=1, poses=False)
    assert {(row["bursts"], row["pairs"]) for row in rows[:-1]} == {(2, 2)}
    assert [row["strength"] for row in rows[:-1]] == [0, 5]


def test_clutter_needs_things_of_another_kind(recorded: Path) -> None:
    with pytest.raises(InvalidInput, match="of another category") as caught:
        run(recorded, None, None, limit=1, degradations=["clutter"])
    assert caught.value.field == "degradation"


def test_figures_of_known_outcomes() -> None:
    right, wrong = PoseError(10, 0, 0), PoseError(100, 0, 0)
    found = figures([Outcome("x", 1, (right, wrong), KNOWN), Outcome("x", 1, (right, right), MISSED)])
    assert (found["acc30"], found["acc15"], found["median_deg"], found["pairs"], found["bursts"]) == (75, 75, 10, 4, 2)
    assert (found["right"], found["nearest"], found["novel"], found["false_known"]) == (50, 50, 50, 50)
    assert found["auroc"] == 50  # 2 is above both rivals, 0 above none


def test_where_a_figure_breaks_is_read_off_straight_lines() -> None:
    assert breaks_at([0, 10, 20], [90, 85, 75]) == pytest.approx(15)
    assert breaks_at([1, 2, 4], [90, 60, 95]) is None  # a dip
    assert breaks_at([1, 2, 4], [90, 60, 20]) == pytest.approx(4 / 3)
    assert breaks_at([95, 50, 20], [90, 90, 70]) == pytest.approx(35)
    assert breaks_at([0, 10], [90, 81]) is None


def test_rows_say_where_each_degradation_breaks() -> None:
    noise = next(each for each in catalogue([]) if each.name == "depth noise")
    good, bad = (PoseError(5, 0, 0),), (NO_POSE,)
    outcomes = [Outcome(CLEAN, 0.0, good, KNOWN)]
    outcomes += [Outcome(noise.name, strength, bad if strength > 10 else good, KNOWN) for strength in noise.strengths]
    *_, last = table_rows([noise], outcomes)
    assert last["acc30_breaks_at"] == pytest.approx(11)
    assert last["auroc_breaks_at"] is None


def test_what_does_not_exist_is_refused(recorded: Path) -> None:
    with pytest.raises(InvalidInput, match="fog"):
        run(recorded, None, None, degradations=["fog"])
    with pytest.raises(InvalidInput, match="cat"):
        run(recorded, None, None, degradations=["jpeg"], categories=["cat"])
    with pytest.raises(InvalidInput, match="views"):
        run(recorded, None, None, views="9", degradations=["jpeg"])
