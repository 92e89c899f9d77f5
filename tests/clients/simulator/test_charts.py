"""The report's charts, against counts made by hand."""

from __future__ import annotations

from dataclasses import replace

import pytest

from clients.pose_error import PoseError
from clients.simulator.charts import Confusion, curve, error_rates, pose_histogram, stage_bars, worst
from clients.simulator.encounter import Encounter, Verdict
from clients.simulator.timeline import NUMBER_WIDTH, Timeline

BASE = Encounter(
    number=1,
    name="cup/1",
    category="cup",
    observation_id="o",
    outcome="known",
    verdict=Verdict.RECOGNISED,
    category_id="c",
    kind="cup",
    nearest_kind="cup",
    similarity=0.6,
    threshold=0.4,
    in_memory=True,
    has_truth=True,
    error=PoseError(5.0, 0.1, 0.0),
    learnt=None,
    learnt_views=0,
    founder_matrix=None,
    best_view=0,
    views=8,
    looks=1,
    offsets_deg=(),
    refused=0,
    view_faults=(),
    failure=None,
    observe_ms=100.0,
    scan_ms=None,
    motion_s=0.0,
    timings_ms={"find": 10.0, "features": 30.0, "points": 10.0, "decide": 1.0, "match": 5.0, "total": 56.0},
)
NEW = replace(
    BASE, outcome="novel", verdict=Verdict.NEW, kind=None, category_id=None, nearest_kind=None, similarity=None, in_memory=False, error=None
)
FALSE_KNOWN = replace(BASE, category="car", verdict=Verdict.FALSE_KNOWN, in_memory=False, similarity=0.45, error=None)
FALSE_NOVEL = replace(BASE, outcome="novel", verdict=Verdict.FALSE_NOVEL, kind=None, category_id=None, similarity=0.3, error=None)
NO_POSE = replace(BASE, error=None)
ALL = [NEW, BASE, FALSE_KNOWN, FALSE_NOVEL, NO_POSE]


def test_a_confusion_matrix_counts_who_was_taken_for_what() -> None:
    confusion = Confusion.of(ALL)
    assert confusion.rows == ("car", "cup")
    assert confusion.columns == ("cup", "novel")
    assert confusion.counts == ((1, 0), (2, 2))
    assert confusion.first == (0, 1)
    assert confusion.right(1, 0)
    assert not confusion.right(0, 0)


def test_error_rates_trade_against_each_other() -> None:
    false_known, false_novel = error_rates(ALL, [0.2, 0.4, 0.5, 0.7])
    assert false_known == pytest.approx([25, 25, 0, 0])
    assert false_novel == pytest.approx([0, 100 / 3, 100 / 3, 100])
    drawn = curve(ALL)
    assert drawn is not None
    assert drawn.low < 0.3 < 0.6 < drawn.high
    assert drawn.threshold_x == pytest.approx(drawn.width * (0.4 - drawn.low) / (drawn.high - drawn.low))
    assert curve([NEW]) is None


def test_poses_are_counted_by_error_and_none_is_the_worst() -> None:
    counts = {bar.label: bar.count for bar in pose_histogram(ALL)}
    assert counts["5–7.5°"] == 1
    assert counts["120–180°"] == 1
    assert sum(counts.values()) == 2


def test_robots_of_one_memory_stand_side_by_side_in_the_timeline() -> None:
    met = [replace(BASE, robot=robot, number=number) for number in (1, 2) for robot in (0, 1)]
    timeline = Timeline(met)
    assert sorted({timeline.x(each) for each in met}) == [timeline.x(each) for each in met]
    assert [each.label for each in met] == ["1", "2.1", "2", "2.2"]


def test_columns_fill_the_width_of_the_timeline_and_labels_are_below_them() -> None:
    timeline = Timeline([BASE, FALSE_KNOWN])
    first, last = (timeline.x(each) for each in timeline.encounters)
    assert (first - timeline.left, timeline.width - last) == pytest.approx((timeline.half_step, timeline.half_step), abs=0.1)
    assert timeline.height > timeline.bottom


def test_a_long_timeline_numbers_what_it_has_room_for() -> None:
    timeline = Timeline([replace(BASE, number=number) for number in range(1, 201)])
    places = [timeline.x(each) for each in timeline.numbered]
    assert len(places) > 20
    assert min(after - before for before, after in zip(places, places[1:])) >= NUMBER_WIDTH


def test_stages_are_medians() -> None:
    assert {bar.label: bar.count for bar in stage_bars([BASE, BASE])} == {"find": 10, "features": 40, "decide": 1, "pose": 5}


def test_the_worst_come_first() -> None:
    assert worst(ALL, 3) == [FALSE_KNOWN, FALSE_NOVEL, NO_POSE]
