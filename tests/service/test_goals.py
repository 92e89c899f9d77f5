"""Goals over HTTP, on a scene where the motion is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.sim3 import Sim3, rotation_angle_deg
from tests.service.conftest import colour_only

GOAL = Sim3(1.0, Rotation.from_euler("z", 40, degrees=True).as_matrix(), np.array([0.5, 0.1, 0.05]))
SMALLER = Sim3(0.7, Rotation.from_euler("z", -20, degrees=True).as_matrix(), np.array([-0.2, 0.3, 0.035]))


@pytest.fixture
def goal(client, ball, look, parts):
    """Where its objects shall end."""
    burst = parts(look(world_from_object=GOAL), lambda about, files: about.update(frame="table"))
    answer = client.post(f"/v1/categories/{ball['id']}/goals", files=burst, params={"name": "on the shelf"})
    assert answer.status_code == 201, answer.text
    return answer.json()


def motion_of(plan):
    return np.array(plan["goal_from_current"]["matrix"])


def test_a_goal_is_kept_with_the_pose_of_what_was_shown(client, ball, goal):
    assert (goal["category_id"], goal["name"], goal["anchor"], goal["frame"]) == (ball["id"], "on the shelf", "center", "table")
    shown = Sim3.from_matrix(np.array(goal["target_from_reference"]["matrix"]))
    assert rotation_angle_deg(shown.rotation, GOAL.rotation) < 3
    assert client.get(f"/v1/goals/{goal['id']}").json() == goal
    assert client.get(f"/v1/categories/{ball['id']}/goals").json() == {"goals": [goal]}


def test_showing_a_goal_teaches_nothing(client, ball, goal):
    assert client.get(f"/v1/categories/{ball['id']}").json()["instances"] == 1


def test_the_plan_takes_an_object_s_centre_and_axes_to_the_goal(client, goal, look, parts):
    answer = client.post(f"/v1/goals/{goal['id']}/plan", files=parts(look(world_from_object=SMALLER)))
    assert answer.status_code == 200, answer.text
    plan, motion = answer.json(), motion_of(answer.json())
    assert np.allclose(motion[:3, :3] @ motion[:3, :3].T, np.eye(3), atol=1e-6)
    assert rotation_angle_deg(motion[:3, :3] @ SMALLER.rotation, GOAL.rotation) < 4
    assert np.linalg.norm(motion[:3, :3] @ SMALLER.translation + motion[:3, 3] - GOAL.translation) < 0.015
    assert plan["angle_deg"] == pytest.approx(60, abs=4)
    assert plan["distance_m"] == pytest.approx(np.linalg.norm(GOAL.translation - SMALLER.translation), abs=0.015)
    seen = client.get(f"/v1/observations/{plan['observation_id']}").json()
    assert np.allclose(plan["world_from_object"], motion @ seen["pose"]["world_from_object"])


def test_by_the_base_a_smaller_object_stands_on_the_same_support(client, goal, look, parts):
    plan = client.post(f"/v1/goals/{goal['id']}/plan", files=parts(look(world_from_object=SMALLER)), params={"anchor": "base"}).json()
    centre = motion_of(plan)[:3, :3] @ SMALLER.translation + motion_of(plan)[:3, 3]
    assert plan["anchor"] == "base"
    assert np.allclose(centre, GOAL.translation - [0, 0, 0.05 * 0.3], atol=0.015)


def test_a_goal_and_a_plan_from_earlier_observations(client, ball, look, parts):
    options = {"category_id": ball["id"], "learn": False}
    placed, seen = (
        client.post("/v1/observations", files=parts(look(world_from_object=each)), params=options).json() for each in (GOAL, SMALLER)
    )
    goal = client.post(f"/v1/categories/{ball['id']}/goals", json={"observation_id": placed["id"]}).json()
    assert goal["target_from_reference"] == placed["pose"]["target_from_reference"]
    plan = client.post(f"/v1/goals/{goal['id']}/plan", json={"observation_id": seen["id"]}).json()
    assert plan["observation_id"] == seen["id"]


def test_frames_of_different_names_are_not_mixed(client, goal, look, parts):
    burst = parts(look(world_from_object=SMALLER), lambda about, files: about.update(frame="camera"))
    answer = client.post(f"/v1/goals/{goal['id']}/plan", files=burst)
    assert answer.status_code == 409
    assert "'table'" in answer.json()["detail"]


def test_an_observation_of_another_category_is_no_source(client, goal, look, parts):
    novel = client.post("/v1/observations", files=parts(look("dark"))).json()
    assert client.post(f"/v1/goals/{goal['id']}/plan", json={"observation_id": novel["id"]}).status_code == 409


def test_views_from_one_direction_do_not_tell_the_base(client, goal, look, parts):
    one = parts(look(world_from_object=SMALLER).select([2]))
    answer = client.post(f"/v1/goals/{goal['id']}/plan", files=one, params={"anchor": "base"})
    assert (answer.status_code, answer.json()["field"]) == (422, "up")
    assert client.post(f"/v1/goals/{goal['id']}/plan", files=one, params={"anchor": "base", "up": [0, 0, 1]}).status_code == 200


def test_an_object_without_a_pose_has_no_plan(client, goal, look, parts):
    answer = client.post(f"/v1/goals/{goal['id']}/plan", files=parts(look(), colour_only))
    assert (answer.status_code, answer.json()["type"]) == (422, "urn:onelook:problem:no-pose")


def test_a_deleted_goal_is_gone(client, goal):
    assert client.delete(f"/v1/goals/{goal['id']}").status_code == 204
    assert client.get(f"/v1/goals/{goal['id']}").status_code == 404
    assert client.delete(f"/v1/goals/{goal['id']}").status_code == 404
