"""The robot client on what is learnt: bursts of categories, merging, splitting, goals and plans, archives; against a service."""

from __future__ import annotations

import numpy as np
import pytest

from clients import errors
from clients.answers.categories import Category
from clients.robot import RobotClient
from core.views import Burst


def test_a_scan_tells_what_is_covered_and_replaces_what_cannot_be_reached(robot: RobotClient, burst: Burst) -> None:
    scan = robot.scan(burst)
    before = np.array(list(scan))
    scan.exclude([0, 1])
    assert not np.allclose(list(scan)[0], before[0])
    np.testing.assert_array_equal(list(scan)[2:], before[2:])
    faults = scan.add(burst.views[0])
    assert all(isinstance(fault, str) for fault in faults)
    assert scan.request.covered.shape == (10,)
    assert scan.request.faults == (faults,)


def test_bursts_join_move_and_leave(robot: RobotClient, learnt: Category, burst: Burst) -> None:
    seen = robot.observe(burst, category_id=learnt.id)
    first, second = robot.instances(learnt.id)
    assert (first.how, second.how, second.source_id) == ("scan", "named", seen.id)
    other = robot.split(learnt.id, [second.id], "mug")
    assert [each.name for each in robot.categories()] == ["car", "mug"]
    alike = robot.similarities(learnt.id)
    assert alike.instance_ids == (first.id,)
    assert alike.matrix.shape == (1, 1)
    assert alike.categories[0].category_id == other.id
    assert robot.merge(learnt.id, other.id).instances == 2
    robot.forget_instance(learnt.id, robot.instances(learnt.id)[-1].id)
    assert robot.category(learnt.id).instances == 1
    with pytest.raises(errors.ConflictProblem):
        robot.forget_instance(learnt.id, first.id)
    assert robot.cloud(learnt.id).startswith(b"ply")


def test_an_object_shown_where_it_belongs_is_brought_there(robot: RobotClient, learnt: Category, burst: Burst) -> None:
    shown = robot.observe(burst, learn=False, category_id=learnt.id)
    goal = robot.set_goal(learnt.id, shown.id, name="the shelf", anchor="base")
    assert shown.pose is not None
    np.testing.assert_allclose(goal.target_from_reference.as_matrix(), shown.pose.matrix, atol=1e-9)
    assert [each.id for each in robot.goals(learnt.id)] == [goal.id]
    plan = robot.plan(goal.id, burst, up=(0, 0, 1))
    assert plan.goal.name == robot.goal(goal.id).name == "the shelf"
    np.testing.assert_allclose(plan.goal_from_current, np.eye(4), atol=0.02)
    np.testing.assert_allclose(plan.world_from_object, shown.pose.world_from_object, atol=0.02)
    robot.forget_goal(goal.id)
    assert robot.goals(learnt.id) == []


def test_the_history_is_paged(robot: RobotClient, learnt: Category, burst: Burst) -> None:
    seen = [robot.observe(burst, learn=False, alternatives=0) for _ in range(3)]
    latest = robot.observations(2, outcome="known", category_id=learnt.id)
    assert [each.id for each in latest] == [seen[2].id, seen[1].id]
    assert robot.observations(2, before=latest[-1].id)[0].id == seen[0].id
    assert latest[0].pose is not None
    assert latest[0].pose.alternatives == ()


def test_what_was_exported_is_imported_where_it_is_not_there(robot: RobotClient, learnt: Category) -> None:
    assert robot.memory().instances == 1
    archive = robot.export_memory([learnt.id])
    brought = robot.import_memory(archive)
    assert (brought.categories, [each.id for each in brought.duplicates]) == ((), [learnt.id])
    robot.forget(learnt.id)
    assert [each.name for each in robot.import_memory(archive).categories] == ["car"]


def test_a_memory_is_backed_up(robot: RobotClient, learnt: Category) -> None:
    assert robot.backup().files > 0


def test_where_a_threshold_is_set_a_rate_is_refused(robot: RobotClient) -> None:
    with pytest.raises(errors.ConflictProblem, match="ONELOOK_THRESHOLD"):
        robot.calibrate(0.02)
