"""The pose benchmark from folders to JSON, on two objects whose pose is known."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import pytest

from benchmarks import pose
from benchmarks.contenders import Setting, Sweep, contender
from benchmarks.pairs import ViewCounts, choose_views
from clients.datasets.folders import find_sequences
from clients.pose_error import NO_POSE, PoseError
from core.errors import InvalidInput, NoPose
from core.pose import PoseEstimator, PoseOptions
from core.sim3 import Sim3

from .conftest import record, travelled

COLUMNS = {
    *("variant", "views", "dims", "category", "pairs", "acc30", "acc15", "acc7_5"),
    *("median_deg", "median_t", "median_log_scale", "median_iou", "solve_ms", "memory_mb", "answered"),
    *("median_t_2pi", "acc_t1_0", "acc_t0_5", "acc_t0_2"),
    *("method", "consensus_deg", "inlier_ratio", "estimator", "dof"),
}
run = partial(pose.run, seed=0, backbone="colour")


@pytest.fixture(autouse=True)
def small(small_world) -> None:
    small_world(pose)


def test_a_known_similarity_is_recovered(recorded: Path, tmp_path: Path) -> None:
    file = tmp_path / "out" / "pose.json"
    run(recorded, Sweep(["ucd"], ["4"]), 1, file)
    written = json.loads(file.read_text())
    category, everything = written["rows"]
    assert set(category) == COLUMNS
    assert (category["category"], everything["category"]) == ("egg", "all")
    assert (category["variant"], category["views"], category["dims"], category["pairs"]) == ("ucd", "4", 32, 1)
    assert category["acc7_5"] == 100
    assert category["median_t"] < 0.03
    assert category["median_log_scale"] < 0.05
    assert written["meta"]["fingerprint"] == "colour-1"


def test_the_same_seed_gives_the_same_figures(recorded: Path) -> None:
    first, again = (run(recorded, Sweep(["ucd"], ["3+2"]), 1, None, seed=5)[0] for _ in range(2))
    assert replace(first, solve_ms=0) == replace(again, solve_ms=0)


def test_a_job_and_its_result_can_travel_between_processes(recorded: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    here = run(recorded, Sweep(["ucd"], ["4"]), 1, None)
    monkeypatch.setattr(pose, "map_jobs", travelled)
    there = run(recorded, Sweep(["ucd"], ["4"]), 1, None)
    assert [replace(row, solve_ms=0) for row in there] == [replace(row, solve_ms=0) for row in here]


def test_each_descriptor_size_asked_for_has_its_rows(recorded: Path) -> None:
    rows = run(recorded, Sweep(["ucd"], ["4"], dims=[6, 64]), 1, None)
    assert [row.dims for row in rows] == [6, 6, 64, 64]


def test_nine_degrees_fit_a_box_that_seven_do_not(tmp_path: Path, ellipsoid) -> None:
    for name, half_axes in (("long", [0.36, 0.3, 0.3]), ("short", [0.3, 0.3, 0.3])):
        record(tmp_path / "data" / "egg" / name, ellipsoid(np.array(half_axes)), Sim3(0.4, np.eye(3), np.zeros(3)), views=8)
    rows = run(tmp_path / "data", Sweep(["ucd"], ["8"], dof=[7, 9]), 2, None)
    seven, nine = (row for row in rows if row.category == "all")
    assert (seven.dof, nine.dof, nine.answered) == (7, 9, 100)
    assert seven.median_iou < nine.median_iou


def test_options_multiply_and_are_in_every_row(recorded: Path, tmp_path: Path) -> None:
    sweep = Sweep(["ucd"], ["4"], methods=["mutual", "cyclical"], consensus_deg=[15.0], inlier_ratios=[0.05], estimators=["ransac"])
    run(recorded, sweep, 1, tmp_path / "pose.json")
    rows = json.loads((tmp_path / "pose.json").read_text())["rows"]
    assert [row["method"] for row in rows] == ["mutual", "mutual", "cyclical", "cyclical"]
    assert {(row["consensus_deg"], row["inlier_ratio"], row["estimator"]) for row in rows} == {(15.0, 0.05, "ransac")}


def test_plus_takes_all_views_of_both_whatever_is_asked_of_the_others(recorded: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []
    estimate = PoseEstimator.estimate

    def watched(self, reference, target, *, seed: int = 0):
        seen.append((self.config.variant, len(reference.views), len(target.views)))
        return estimate(self, reference, target, seed=seed)

    monkeypatch.setattr(PoseEstimator, "estimate", watched)
    rows = run(recorded, Sweep(["ucd", "ucd+"], ["3", "3+2"]), 1, None)
    assert seen == [("ucd", 3, 3), ("ucd", 3, 2), ("ucd+", 4, 4)]
    assert [row.views for row in rows if row.category == "all"] == ["3", "3+2", "all"]


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"variants": ["nonsense"]}, "variant"),
        ({"views": ["9"]}, "views"),
        ({"views": ["many"]}, "views"),
        ({"dims": [65]}, "dims"),
        ({"methods": ["psychic"]}, "method"),
        ({"estimators": ["luck"]}, "estimator"),
        ({"inlier_ratios": [0.0]}, "inlier_ratio"),
        ({"variants": ["u"], "consensus_deg": [15.0]}, "consensus_deg"),
    ],
)
def test_what_cannot_be_run_is_said_with_its_field(recorded: Path, change: dict[str, object], field: str) -> None:
    given = {"variants": ["ucd"], "views": ["4"]} | change
    with pytest.raises(InvalidInput) as caught:
        run(recorded, Sweep(**given), limit=1, json=None)
    assert caught.value.field == field


def test_a_refused_pose_counts_as_180(recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise NoPose("nothing fits")

    monkeypatch.setattr(PoseEstimator, "estimate", refuse)
    (row, _) = run(recorded, Sweep(["ucd"], ["4"]), 1, tmp_path / "pose.json")
    assert (row.acc30, row.median_deg) == (0, 180)
    assert json.loads((tmp_path / "pose.json").read_text())["rows"][0]["median_t"] is None


def test_a_target_in_whose_views_nothing_is_found_counts_as_180(recorded: Path) -> None:
    (black,) = choose_views("egg/small", "target", 4, 1, 0)
    file = recorded / "egg" / "small" / "rgb" / f"{black:06}.png"
    cv2.imwrite(str(file), np.zeros_like(cv2.imread(str(file))))
    row, _ = run(recorded, Sweep(["ucd"], ["4+1"]), 2, None)
    assert (row.pairs, row.answered) == (2, 50)


def test_a_setting_that_is_named_twice_is_run_once(recorded: Path) -> None:
    rows = run(recorded, Sweep(["ucd", "ucd"], ["4", "4"], dims=[32, 32]), 1, None)
    assert [(row.category, row.pairs) for row in rows] == [("egg", 1), ("all", 1)]


def test_all_is_the_mean_over_categories_not_over_pairs(recorded: Path) -> None:
    large, small = find_sequences(recorded)
    setting = Setting(ViewCounts("4", 4, 4), contender("ucd", PoseOptions(), 64))
    exact = PoseError(0.0, 0.0, 0.0)
    results = [
        pose.JobResult(pose.Job(setting, large, (small,), {}, 0), (exact,), (1.0,), (7,), (1.0,), 2.0),
        pose.JobResult(
            pose.Job(setting, replace(small, category="cup"), (large,) * 3, {}, 0),
            (NO_POSE, NO_POSE, exact),
            (0.0, 0.0, 1.0),
            (0, 0, 7),
            (3.0,) * 3,
            4.0,
        ),
    ]
    cup, egg, everything = pose.table_rows(setting, results)
    assert (cup.category, egg.category, everything.category) == ("cup", "egg", "all")
    assert (egg.acc30, cup.acc30) == (100, pytest.approx(100 / 3))
    assert everything.acc30 == pytest.approx(200 / 3)
    assert (egg.answered, cup.answered) == (100, pytest.approx(100 / 3))
    assert (everything.median_iou, cup.median_iou) == (50, 0)
    assert (everything.pairs, everything.solve_ms, everything.memory_mb) == (4, 2, 3)
    assert (cup.median_deg, everything.median_deg, everything.median_t) == (180, 90, np.inf)
