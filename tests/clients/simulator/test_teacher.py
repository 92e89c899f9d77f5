"""The simulated teacher, and several robots that share a memory, against a service that knows again only what it has seen."""

from __future__ import annotations

from pathlib import Path

import pytest

from clients.datasets.folders import Sequence
from clients.errors import ClientError
from clients.robot import RobotClient
from clients.simulator.encounter import Verdict
from clients.simulator.episode import Conduct, Episode, Truth
from clients.simulator.fleet import disagreements, together
from clients.simulator.replay import ReplaySubject
from clients.simulator.teacher import Lesson, Lessons, TeacherConfig
from clients.simulator.world import Subject


@pytest.fixture
def two(recordings: list[Sequence]) -> dict[str, Sequence]:
    """An object of each of two categories."""
    first = recordings[0]
    return {each.category: each for each in (first, next(each for each in recordings if each.category != first.category))}


def test_a_robot_that_answers_well_is_taught_all(robot: RobotClient, two: dict[str, Sequence]) -> None:
    lessons = Lessons(robot, lambda category, index: ReplaySubject(two[category]), list(two), Conduct(views=12))
    done = list(lessons)
    assert [each.action for each in done] == ["teach", "ask", "teach", "ask", "ask"]
    assert [each.right for each in done] == [True] * 5
    summary = lessons.summary
    assert (summary.categories_learnt, summary.questions, summary.corrections, summary.ended) == (2, 3, 0, "all learnt")
    assert summary.accuracy == 100
    assert summary.instances_a_category == 1


def test_wrong_answers_are_corrected_until_patience_ends(robot: RobotClient, recordings: list[Sequence]) -> None:
    """Each object is another one, which this backbone never recognises; a corrected burst joins its category."""
    pool = [each for each in recordings if each.category == recordings[0].category]
    lessons = Lessons(
        robot, lambda category, index: ReplaySubject(pool[index]), [pool[0].category], Conduct(views=6), TeacherConfig(patience=2)
    )
    done = list(lessons)
    assert [(each.action, each.answer, each.corrected) for each in done] == [
        ("teach", None, False),
        ("ask", None, True),
        ("ask", None, True),
    ]
    summary = lessons.summary
    assert (summary.categories_learnt, summary.corrections, summary.ended) == (0, 2, "patience")
    assert summary.instances_a_category == 3


def test_interrupted_lessons_go_on_where_they_stopped(robot: RobotClient, two: dict[str, Sequence]) -> None:
    def lessons(done: list[Lesson]) -> Lessons:
        return Lessons(robot, lambda category, index: ReplaySubject(two[category]), list(two), Conduct(views=12), done=done)

    begun = iter(lessons([]))
    before = [next(begun) for _ in range(3)]
    again = lessons(before)
    done = list(again)
    assert done[:3] == before
    assert [(each.number, each.action, each.right, each.known) for each in done[3:]] == [(4, "ask", True, 2), (5, "ask", True, 2)]
    assert len(robot.categories()) == 2
    assert (again.summary.categories_learnt, again.summary.questions) == (2, 3)


def test_a_teacher_without_objects_says_so(robot: RobotClient, recordings: list[Sequence]) -> None:
    lessons = Lessons(robot, lambda category, index: [ReplaySubject(recordings[0])][index], [recordings[0].category], Conduct(views=6))
    assert len(list(lessons)) == 1
    assert lessons.summary.ended == "no more objects"


def test_robots_at_once_leave_the_memory_as_they_made_it(url: str, two: dict[str, Sequence]) -> None:
    truth, conduct = Truth(), Conduct(views=12)
    with RobotClient(url) as first, RobotClient(url) as second:
        plans: list[list[Subject]] = [[ReplaySubject(each)] * 2 for each in two.values()]
        episodes = [
            Episode(robot, plan, conduct, truth=truth, number=number) for number, (robot, plan) in enumerate(zip((first, second), plans))
        ]
        met = list(together(episodes))
        assert sorted((each.robot, each.number) for each in met) == [(0, 1), (0, 2), (1, 1), (1, 2)]
        assert sorted(each.verdict.value for each in met) == sorted([Verdict.NEW.value] * 2 + [Verdict.RECOGNISED.value] * 2)
        assert disagreements(first, met) == []
        forgotten = next(each.learnt for each in met if each.learnt)
        first.forget(forgotten)
        assert "is gone" in disagreements(first, met)[0]
        assert "nobody learnt it" in disagreements(first, [each for each in met if not each.learnt])[0]


def test_what_stops_one_robot_is_raised_when_all_have_ended(url: str, recordings: list[Sequence], tmp_path: Path) -> None:
    class Broken:
        category, name = "none", "none/0"

        def enter(self) -> None:
            raise ClientError("the world broke")

    with RobotClient(url) as robot:
        episodes = [Episode(robot, [ReplaySubject(recordings[0])], Conduct(views=3)), Episode(robot, [Broken()], Conduct(), number=1)]  # type: ignore[list-item]
        with pytest.raises(ClientError, match="the world broke"):
            list(together(episodes))
