"""A robot looks once more at what it knows: where from, what it asks, and what is told of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clients.datasets.folders import Sequence
from clients.errors import NoObjectProblem
from clients.pose_error import PoseError
from clients.robot import RobotClient
from clients.simulator.arm import UP, Arm, ArmConfig, Limits
from clients.simulator.encounter import Encounter, Verdict
from clients.simulator.episode import Conduct, Episode
from clients.simulator.live import summary_rows
from clients.simulator.pictures import fetch_pictures
from clients.simulator.replay import ReplaySubject
from clients.simulator.report import EpisodeRecord, write_report
from clients.simulator.summary import summarise
from clients.simulator.waypoints import Waypoint, visit_waypoints
from core.sim3 import Sim3
from core.views import Burst

from .test_arm import CENTER_M, EmptyWorld
from .test_report import Page

HERE = np.eye(4).tolist()


class Answer:
    """What the tests need of an observation."""

    def __init__(self, number: int) -> None:
        self.id, self.category_id, self.pose_error = f"o{number}", "c", None
        self.pose = type("P", (), {"world_from_object": CENTERED, "extent_m": np.full(3, 0.1), "matrix": Sim3.identity().as_matrix()})()


CENTERED = np.eye(4)
CENTERED[:3, 3] = CENTER_M


class Service:
    """Answers every burst, and keeps what it was asked."""

    def __init__(self, blind: bool = False) -> None:
        self.asked: list[tuple[Burst, dict[str, Any]]] = []
        self._blind = blind

    def observe(self, burst: Burst, **options: Any) -> Answer:
        """Nothing where it is blind."""
        self.asked.append((burst, options))
        if self._blind:
            raise NoObjectProblem("views: no view shows an object that stands out", status=422)
        return Answer(len(self.asked))


def visit(service: Any, arm: Arm, count: int = 30) -> Any:
    """Waypoints about an object at CENTER_M, after a glance at it."""
    burst = arm.glance(8, 0)
    return visit_waypoints(service, arm, Answer(0), burst, count, 5, lambda _: PoseError(1.0, 0.1, 0.0))  # type: ignore[arg-type]


def test_each_view_is_asked_for_by_itself_of_the_known_category_without_learning() -> None:
    service, arm = Service(), Arm(EmptyWorld())
    visited = visit(service, arm)
    assert len(visited.waypoints) == len(service.asked)
    for waypoint, (burst, options) in zip(visited.waypoints, service.asked):
        (view,) = burst.views
        assert options == {"category_id": "c", "learn": False}
        assert view.camera is not None
        pose = view.camera.world_from_camera
        assert np.array_equal(waypoint.world_from_camera, pose)
        assert np.cross(pose[:3, 2], CENTER_M - pose[:3, 3]) == pytest.approx(np.zeros(3), abs=1e-9)
        assert (pose[:3, 3] - CENTER_M) @ UP > 0
    assert [each.observation_id for each in visited.waypoints] == [f"o{number + 1}" for number in range(len(service.asked))]


def test_what_is_out_of_reach_is_left_out_and_counted_and_motion_takes_time() -> None:
    world = EmptyWorld()
    arm = Arm(world, ArmConfig(limits=Limits(reach_m=(0.28, 0.6))))
    looked = arm.glance(8, 0)
    clock_s, captured = arm.clock_s, world.captured
    visited = visit_waypoints(Service(), arm, Answer(0), looked, 30, 5, lambda _: None)  # type: ignore[arg-type]
    assert visited.waypoints
    assert visited.out_of_reach > 0
    assert len(visited.waypoints) + visited.out_of_reach == 30
    assert world.captured - captured == len(visited.waypoints)
    assert arm.clock_s > clock_s + arm.config.settle_s * len(visited.waypoints)
    assert all(arm.cannot_reach(np.array(each.world_from_camera)) is None for each in visited.waypoints)


def test_a_waypoint_from_which_nothing_is_seen_says_so() -> None:
    visited = visit(Service(blind=True), Arm(EmptyWorld()), 4)
    assert {(each.observation_id, each.error, each.target_from_reference) for each in visited.waypoints} == {("", None, None)}
    assert visited.waypoints[0].failure == "views: no view shows an object that stands out"


def test_where_there_is_no_pose_there_is_nothing_to_aim_at() -> None:
    answer = Answer(0)
    answer.pose = None
    arm = Arm(EmptyWorld())
    visited = visit_waypoints(Service(), arm, answer, arm.glance(4, 0), 3, 0, lambda _: None)  # type: ignore[arg-type]
    assert (visited.waypoints, visited.out_of_reach) == ((), 0)


def test_an_episode_keeps_the_pose_of_every_waypoint_and_learns_nothing_from_them(
    robot: RobotClient, recordings: list[Sequence], tmp_path: Path, record: EpisodeRecord
) -> None:
    encounters = list(Episode(robot, [ReplaySubject(recordings[0])] * 2, Conduct(views=12, waypoints=3)))
    new, again = encounters
    assert (new.verdict, again.verdict) == (Verdict.NEW, Verdict.RECOGNISED)
    assert new.waypoints == ()
    assert len(again.waypoints) == 3
    assert Encounter.from_json(again.as_json()) == again
    for waypoint in again.waypoints:
        assert (waypoint.error is None) == (waypoint.target_from_reference is None)
    (category,) = robot.categories()
    assert category.instances == 2
    pictures = {index: fetch_pictures(robot, each) for index, each in enumerate(encounters)}
    assert all(pictures[1].waypoints)
    whole = replace(record, summary=summarise(encounters, 1.0), encounters=encounters, pictures=pictures)
    write_report(whole, tmp_path / "report.html")
    page = Page((tmp_path / "report.html").read_text())
    assert page.open == []
    assert all(f"waypoint {number}" in page.text for number in (1, 2, 3))


def test_the_same_seed_goes_to_the_same_waypoints() -> None:
    first, second = (visit(Service(), Arm(EmptyWorld())) for _ in range(2))
    assert first == second


def test_the_spread_is_over_all_waypoints(record: EpisodeRecord) -> None:
    base = next(each for each in record.encounters if each.verdict is Verdict.RECOGNISED)
    errors = [PoseError(2.0, 0.02, 0.1), PoseError(4.0, 0.04, 0.1), PoseError(90.0, 0.5, 0.1)]
    posed = tuple(Waypoint("o", HERE, HERE, error, None) for error in errors)
    without = Waypoint("o", HERE, None, None, "too few correspondences agree")
    met = [replace(base, waypoints=(*posed[:2], without), waypoints_out_of_reach=2), replace(base, waypoints=posed[2:]), base]
    summary = summarise(met, 1.0)
    assert summary.waypoints is not None
    assert (summary.waypoints.visited, summary.waypoints.out_of_reach, summary.waypoints.without_pose) == (4, 2, 1)
    assert (summary.waypoints.median_deg, summary.waypoints.worst_deg) == (4.0, 90.0)
    assert (summary.waypoints.median_translation, summary.waypoints.worst_translation) == (0.04, 0.5)
    shown = {what: (figure, rest) for what, figure, rest in summary_rows(summary)}
    assert shown["rotation there"] == ("4.0°", "median error; 90.0° the worst")
    assert summarise([base], 1.0).waypoints is None
