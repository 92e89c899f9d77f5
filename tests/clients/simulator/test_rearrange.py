"""The rearrangement experiment, with a robot's client that answers what it is told to: the measuring must be right."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from clients.errors import NoPoseProblem
from clients.robot import RobotClient
from clients.simulator import rearrange
from clients.simulator.raycast.mesh import rotation_about
from clients.simulator.raycast.sensor import SensorConfig
from clients.simulator.raycast.world import RaycastWorld
from clients.simulator.rearrange import Rearrangement, drawn_before, summarise, write_picture
from core.sim3 import Sim3


class Oracle:
    """Knows where everything is, and plans as it is told: to the goal, but off by a turn and a shift."""

    def __init__(self, worlds: list[RaycastWorld], turn_deg: float = 0.0, shift_m: float = 0.0) -> None:
        self._worlds = worlds
        self._off = np.eye(4)
        self._off[:3, :3] = rotation_about("z", turn_deg)
        self._off[0, 3] = shift_m
        self._goal: Sim3 | None = None
        self.refuse = False
        self.known: list[Any] = []
        self.kept: list[Any] = []

    def scan(self, burst: Any) -> Any:
        return FakeScan(SimpleNamespace(center_m=np.zeros(3)))

    def observe(self, burst: Any, **options: Any) -> Any:
        if self.refuse and "category_id" not in options:
            raise NoPoseProblem("no transform explains the views", status=422)
        return SimpleNamespace(id="o", outcome="known", category_id="c")

    refuse_goals = False

    def categories(self) -> list[Any]:
        return self.known

    def goals(self, category_id: str) -> list[Any]:
        return self.kept

    def set_goal(self, category_id: str, source: str, **options: Any) -> Any:
        if self.refuse_goals:
            raise NoPoseProblem("the reference has no pose", status=422)
        self._goal = self._worlds[-1].objects[0].world_from_model
        self.kept = [SimpleNamespace(id="g")]
        return self.kept[0]

    def plan(self, goal_id: str, source: str, **options: Any) -> Any:
        now = self._worlds[-1].objects[0].world_from_model
        assert now is not None
        assert self._goal is not None
        motion = np.eye(4)
        motion[:3, :3] = self._off[:3, :3] @ self._goal.rotation @ now.rotation.T
        aim = np.array([*self._goal.translation[:2], now.translation[2]]) + self._off[:3, 3]
        motion[:3, 3] = aim - motion[:3, :3] @ now.translation
        return SimpleNamespace(goal_from_current=motion, distance_m=0.2, angle_deg=90.0)


class FakeScan(list[Any]):
    """Asks for no views."""

    def __init__(self, request: Any) -> None:
        super().__init__()
        self.request = request

    def complete(self, name: str | None) -> Any:
        return SimpleNamespace(id="c")


@pytest.fixture
def worlds(monkeypatch: pytest.MonkeyPatch) -> list[RaycastWorld]:
    """Every world that is made, in order."""
    made: list[RaycastWorld] = []

    def make(*arguments: Any, **options: Any) -> RaycastWorld:
        made.append(RaycastWorld(*arguments, **options))
        return made[-1]

    monkeypatch.setattr(rearrange, "RaycastWorld", make)
    return made


def batch(robot: Oracle, small: SensorConfig, trials: int = 1) -> Rearrangement:
    client: RobotClient = robot  # type: ignore[assignment]
    return Rearrangement(client, ["mug"], trials, views=2, seed=0, sensor=small)


def test_a_plan_that_is_off_is_measured_to_be_off(worlds: list[RaycastWorld], small: SensorConfig, tmp_path: Path) -> None:
    trials = batch(Oracle(worlds, turn_deg=10.0, shift_m=0.02), small)
    (trial,) = trials
    assert trial.rotation_deg == pytest.approx(10.0, abs=1e-3)
    assert trial.position_m == pytest.approx(0.02, abs=1e-6)
    assert trial.start_position_m is not None
    assert trial.start_position_m > 0.15
    assert trial.name != trial.reference
    assert trial.motion_s > 5
    write_picture(trials.pictures, tmp_path / "rows.png")
    assert (tmp_path / "rows.png").stat().st_size > 1000


def test_a_batch_that_goes_on_keeps_what_it_has_drawn(tmp_path: Path) -> None:
    file = tmp_path / "rows.png"
    assert drawn_before(file) == []
    first, second = (np.full((4, 6, 3), grey, np.uint8) for grey in (50, 200))
    write_picture([first], file)
    write_picture([*drawn_before(file), second], file)
    np.testing.assert_array_equal(drawn_before(file)[0], np.vstack([first, second]))


def test_a_refused_plan_moves_nothing_and_counts_as_wrong(worlds: list[RaycastWorld], small: SensorConfig) -> None:
    robot = Oracle(worlds)
    robot.refuse = True
    (trial,) = batch(robot, small)
    assert trial.rotation_deg is None
    assert trial.failure == "no transform explains the views"
    summary = summarise([trial])
    assert (summary.trials, summary.moved, summary.acc30, summary.success, summary.median_deg) == (1, 0, 0.0, 0.0, None)


def test_a_goal_that_cannot_be_shown_costs_its_trials_and_no_others(worlds: list[RaycastWorld], small: SensorConfig) -> None:
    robot = Oracle(worlds)
    robot.refuse_goals = True
    trials = list(batch(robot, small, trials=2))
    assert [each.failure for each in trials] == ["no goal: the reference has no pose"] * 2
    summary = summarise(trials)
    assert (summary.trials, summary.moved, summary.start_median_deg) == (2, 0, None)


def test_an_interrupted_batch_goes_on_with_the_goals_that_it_set(worlds: list[RaycastWorld], small: SensorConfig) -> None:
    robot = Oracle(worlds, turn_deg=10.0)
    robot.known, robot.kept = [SimpleNamespace(id="c", name="mug")], [SimpleNamespace(id="g")]
    robot.refuse_goals = True  # it must not be shown again
    client: RobotClient = robot  # type: ignore[assignment]
    rest = Rearrangement(client, ["mug"], 2, views=2, seed=0, sensor=small, done=1)
    robot.plan = lambda *ids, **options: SimpleNamespace(goal_from_current=np.eye(4), distance_m=0.0, angle_deg=0.0)  # type: ignore[method-assign]
    (trial,) = rest
    assert trial.number == 2
    assert (trial.rotation_deg, trial.position_m) == (trial.start_rotation_deg, trial.start_position_m)
