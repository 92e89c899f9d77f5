"""The whole loop over HTTP, on a scene where the answer is known."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from core.sim3 import Sim3, rotation_angle_deg
from tests.service.conftest import colour_only

PLACED = Sim3(1.3, Rotation.from_rotvec([0.2, -0.3, 0.9]).as_matrix(), np.array([0.4, -0.2, 0.1]))


def test_an_empty_memory_finds_a_burst_novel_and_asks_for_a_scan(client, look, parts):
    answer = client.post("/v1/observations", files=parts(look()))
    assert answer.status_code == 201
    seen = answer.json()
    assert (seen["outcome"], seen["category_id"], seen["pose"], seen["similarities"]) == ("novel", None, None, [])
    assert np.array(seen["scan"]["world_from_camera"]).shape == (10, 4, 4)
    assert np.linalg.norm(seen["scan"]["center_m"]) < 0.05
    assert 0.2 <= seen["scan"]["radius_m"] < 1.5
    assert seen["scan"]["observation_id"] == seen["id"]


def test_a_scanned_object_is_known_and_its_similarity_transform_recovered(client, look, parts, ball):
    seen = client.post("/v1/observations", files=parts(look("bright", world_from_object=PLACED))).json()
    assert (seen["outcome"], seen["category_id"], seen["name"]) == ("known", ball["id"], "ball")
    found = seen["pose"]["target_from_reference"]
    assert abs(np.log(found["scale"] / PLACED.scale)) < 0.03
    assert rotation_angle_deg(np.array(found["matrix"])[:3, :3] / found["scale"], PLACED.rotation) < 3
    assert np.linalg.norm(np.array(found["translation_m"]) - PLACED.translation) < 0.01
    assert np.allclose(
        Rotation.from_quat(found["quaternion"], scalar_first=True).as_matrix() * found["scale"], np.array(found["matrix"])[:3, :3]
    )


def test_the_box_of_a_known_object_is_around_it(client, look, parts, ball):
    pose = client.post("/v1/observations", files=parts(look("bright", world_from_object=PLACED))).json()["pose"]
    corners = np.array(pose["box"]["corners_m"])
    assert np.linalg.norm(corners.mean(axis=0) - PLACED.translation) < 0.03
    assert np.allclose(corners.mean(axis=0), np.array(pose["world_from_object"])[:3, 3])
    assert np.allclose(np.linalg.norm(corners[1] - corners[0]), pose["box"]["extent_m"][0])


def test_another_kind_stays_novel_and_becomes_a_second_category(client, look, parts, learn):
    first = learn("bright")
    seen = client.post("/v1/observations", files=parts(look("dark"))).json()
    assert seen["outcome"] == "novel"
    assert seen["similarities"][0]["category_id"] == first["id"]
    second = learn("dark")
    seen = client.post("/v1/observations", files=parts(look("dark", views=3))).json()
    assert (seen["outcome"], seen["category_id"]) == ("known", second["id"])


def test_both_body_forms_are_answered_alike(client, look, parts, npz, ball):
    burst = look("bright", world_from_object=PLACED)
    by_parts = client.post("/v1/observations", files=parts(burst)).json()
    by_npz = client.post("/v1/observations", content=npz(burst), headers={"content-type": "application/x-npz"}).json()
    assert by_npz["outcome"] == by_parts["outcome"] == "known"
    assert np.allclose(by_npz["pose"]["target_from_reference"]["matrix"], by_parts["pose"]["target_from_reference"]["matrix"], atol=0.01)


def test_one_view_is_enough_for_a_target(client, look, parts, ball):
    seen = client.post("/v1/observations", files=parts(look("bright", views=6).select([2])), params={"threshold": -1}).json()
    assert (seen["outcome"], seen["views"]) == ("known", 1)
    assert seen["pose"] is not None


def test_photographs_without_depth_and_cameras_are_recognised_without_a_pose(client, look, parts, ball):
    seen = client.post("/v1/observations", files=parts(look("bright"), colour_only)).json()
    assert (seen["outcome"], seen["pose"]) == ("known", None)
    assert "K" in seen["pose_error"]


def test_cameras_without_depth_are_enough_for_a_pose(client, look, parts, ball):
    burst = parts(look("bright", world_from_object=PLACED), lambda about, files: files["depth"].clear())
    seen = client.post("/v1/observations", files=burst, params={"category_id": ball["id"]}).json()
    assert seen["pose"] is not None, seen["pose_error"]
    found = Sim3.from_matrix(np.array(seen["pose"]["target_from_reference"]["matrix"]))
    assert rotation_angle_deg(found.rotation, PLACED.rotation) < 10


def test_a_novel_photograph_has_no_scan_and_says_why(client, look, parts):
    seen = client.post("/v1/observations", files=parts(look("bright"), colour_only)).json()
    assert (seen["outcome"], seen["scan"]) == ("novel", None)
    assert "world_from_camera" in seen["scan_error"]


def test_the_same_seed_gives_the_same_pose(client, look, parts, ball):
    burst = parts(look("bright", world_from_object=PLACED))
    poses = [client.post("/v1/observations", files=burst, params={"seed": 7}).json()["pose"] for _ in range(2)]
    assert poses[0] == poses[1]
