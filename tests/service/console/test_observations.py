"""The page of one observation: what its answer rests on, and the correction of a person who may."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.boxes import OrientedBox
from core.matches import Matches
from core.pose_estimate import Alternative
from core.sim3 import Sim3
from service.console.alignment import moved
from service.console.evidence import Hypothesis, Matrix, Stage
from service.features import PoseDetails
from store.records import Pose

TURNED = Sim3(1.3, np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.array([0.2, 0, 0.1]))


@pytest.fixture
def seen(client, ball, look, parts):
    """An object of it that stands elsewhere."""
    return client.post("/v1/observations", files=parts(look(world_from_object=TURNED)), params={"category_id": ball["id"]}).json()


def page(client, seen):
    answer = client.get(f"/observations/{seen['id']}")
    assert answer.status_code == 200
    return answer.text


def test_every_view_is_shown_with_its_box(client, seen):
    assert len(re.findall(r'src="/v1/observations/\w+/overlay.png\?view=\d&amp;side=480"', page(client, seen))) == 6


def test_all_pairs_of_views_are_shown_and_the_used_ones_marked(client, seen):
    text = page(client, seen)
    debug = client.get(f"/v1/observations/{seen['id']}", params={"include": "debug"}).json()["debug"]
    used = len(debug["pairs"])
    assert "Similarity of 6 reference views and 6 views of the burst" in text
    assert f"{used} pairs are used" in text
    assert text.count('<rect class="chosen" x=') == used + 1, "one is the legend's"


def test_the_points_of_both_objects_meet(client, seen):
    scene = client.get(f"/observations/{seen['id']}/scene.json").json()
    reference, target = (np.array(cloud["points"]).reshape(-1, 3) for cloud in scene["clouds"])
    assert [cloud["name"] for cloud in scene["clouds"]] == ["reference", "seen"]
    np.testing.assert_allclose(np.median(reference, axis=0), np.median(target, axis=0), atol=0.02)
    assert len(scene["cameras"]) == 6
    assert np.array(scene["boxes"][0]["corners"]).shape == (8, 3)


def test_without_a_pose_the_page_says_less(client, look, parts):
    novel = client.post("/v1/observations", files=parts(look())).json()
    text = page(client, novel)
    assert "Not seen before" in text
    assert "waits for views" in text
    assert "Correspondences" not in text
    assert client.get(f"/observations/{novel['id']}/scene.json").status_code == 404
    assert client.get(f"/observations/{novel['id']}/correspondences", params={"view": 0}).status_code == 404


def test_cameras_without_depth_are_enough_for_a_page(client, ball, look, parts):
    burst = look(world_from_object=TURNED)
    files = parts(burst, lambda about, files: files.update(depth=[]))
    seen = client.post("/v1/observations", files=files, params={"category_id": ball["id"]}).json()
    assert seen["pose"] is not None, seen["pose_error"]
    assert "Correspondences" in page(client, seen)
    reference, target = client.get(f"/observations/{seen['id']}/scene.json").json()["clouds"]
    assert reference["points"]
    assert target["points"] == []


def test_images_alone_are_enough_for_a_page(client, ball, look, parts):
    files = [part for part in parts(look(views=2), lambda about, files: (about.clear(), files.update(depth=[]))) if part[0] != "depth"]
    seen = client.post("/v1/observations", files=files).json()
    assert "What is drawn" in page(client, seen)


def test_where_to_look_next_is_told(client, ball, look, parts, monkeypatch):
    agent = client.app.state.running.agent
    seen = client.post("/v1/observations", files=parts(look(views=2)), params={"threshold": 2.0}).json()
    found = agent.memory.observations.get(seen["id"])
    kept = replace(found, outcome="uncertain", viewpoints=np.eye(4)[None])
    monkeypatch.setattr(agent.memory.observations, "get", lambda observation_id: kept)
    assert re.search(r"A look from 0\.00, 0\.00, 0\.00 m would tell most", page(client, seen))


def test_a_deleted_category_takes_its_pictures_along(client, ball, seen):
    client.delete(f"/v1/categories/{ball['id']}")
    text = page(client, seen)
    assert "Of a category deleted since" in text
    assert "correspondences.png" not in text


def test_a_correction_is_told_and_lists_what_there_is(client, ball, seen, learn):
    stone = learn("dark", "stone")
    assert re.search(rf'<option value="{stone["id"]}">stone</option>', page(client, seen))
    answer = client.post(f"/observations/{seen['id']}/correct", data={"category_id": stone["id"]})
    assert (answer.status_code, answer.headers["hx-refresh"]) == (204, "true")
    assert f'Corrected: it was of <a href="/categories/{stone["id"]}">stone</a>' in page(client, seen)
    assert client.get("/v1/memory/audit").json()["entries"][0]["actor"] == "console"


def test_an_unknown_observation_is_a_page_that_says_so(client):
    answer = client.get("/observations/none")
    assert (answer.status_code, answer.headers["content-type"]) == (404, "text/html; charset=utf-8")
    assert "no observation has the id" in answer.text


def test_the_matrix_counts_inliers_of_each_pair():
    matches = Matches(*(np.array(each) for each in ([0, 0, 1], [0, 1, 2], [1, 1, 0], [0, 1, 2], [0.5, 0.6, 0.7], [True, False, True])))
    found = Matrix.of(PoseDetails(matches, np.array([[0.1, 0.5], [0.9, 0.3]]), ((0, 1), (1, 0))))
    assert {(cell.row, cell.column): cell.inliers for cell in found.cells if cell.chosen} == {(0, 1): 1, (1, 0): 1}
    assert {(cell.row, cell.column): cell.level for cell in found.cells}[1, 0] == 1
    assert found.rests_on == (0, 1)


NO_MATCHES = Matches(*(np.zeros(0, dtype) for dtype in (int, int, int, int, float, bool)))


def test_pairs_that_were_not_compared_have_no_cell_and_no_part_in_the_scale():
    found = Matrix.of(PoseDetails(NO_MATCHES, np.array([[28.0, 0.0], [44.0, 36.0]]), ((1, 0),)))
    assert (found.low, found.high) == (28.0, 44.0)
    assert [(cell.row, cell.column, cell.level) for cell in found.cells] == [(0, 0, 0.0), (1, 0, 1.0), (1, 1, 0.5)]


def test_a_matrix_of_nothing_compared_is_empty():
    assert Matrix.of(PoseDetails(NO_MATCHES, np.zeros((2, 2)), ())).cells == ()


def test_how_far_a_hypothesis_is_turned_is_told_but_for_the_symmetries_of_the_object():
    answered, rival, half_turn = (Rotation.from_euler("z", angle_deg, degrees=True).as_matrix() for angle_deg in (0, 170, 180))
    alternative = Alternative(Sim3(1.0, rival, np.zeros(3)), 0.4, None)
    box = OrientedBox(np.eye(4), np.ones(3))
    pose = Pose(Sim3(1.0, answered, np.zeros(3)), box, 9, 9, 0, 0.01, 0.5, None, (alternative,), (), symmetries=half_turn[None])
    assert [each.turned_deg for each in Hypothesis.all_of(pose)] == pytest.approx([0, 10])


def test_stages_fill_the_bar():
    stages = Stage.all_of({"find": 30.0, "decide": 60.0, "refine": 10.0, "total": 100.0})
    assert [(stage.name, stage.part, stage.start, stage.width) for stage in stages] == [
        ("find", "encode", 0, 30),
        ("decide", "decide", 30, 60),
        ("refine", "pose", 90, 10),
    ]


def test_the_reference_is_moved_as_the_pose_says(client, ball, seen):
    agent = client.app.state.running.agent
    pose = agent.memory.observations.get(seen["id"]).pose
    reference = agent.memory.categories.reference(ball["id"])
    np.testing.assert_allclose(moved(pose, reference), pose.target_from_reference.apply(reference.cloud_m))
