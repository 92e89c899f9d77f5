"""Bursts that no camera takes: depth that is not measured, cameras that cannot be, units that differ, views of the same place or of two
objects. What cannot be is refused, what is only poor is told of."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from core.sim3 import Sim3
from core.views import Burst
from tests.service.problems import refused

NPZ = {"content-type": "application/x-npz"}
DEPTHS = {
    "denormal numbers": (lambda depth: np.full_like(depth, 1e-40), "views[0].depth", "depth_scale"),
    "minus infinity": (lambda depth: np.where(depth > 0, -np.inf, 0), "views[0].depth", "NaN or infinite"),
    "negative": (lambda depth: -depth, "views[0].depth", "negative"),
    "huge": (lambda depth: np.where(depth > 0, 3e38, 0), "views[0].depth", "millimetres sent as metres"),
}


@pytest.mark.parametrize("case", DEPTHS)
def test_depth_that_no_camera_measures_is_refused(client, look, npz, case):
    change, field, word = DEPTHS[case]
    burst = look()
    depth = np.stack([change(view.depth_m) for view in burst.views]).astype(np.float32)
    refused(client.post("/v1/observations", content=npz(burst, depth_m=depth), headers=NPZ), 422, field, word)


def test_a_few_denormal_depths_are_taken_for_not_measured(client, look, npz, learn):
    category, burst = learn(), look(views=4)
    depth = np.stack([view.depth_m for view in burst.views])
    depth[:, ::7, ::7] = np.where(depth[:, ::7, ::7] > 0, np.float32(1e-40), 0)
    answer = client.post("/v1/observations", content=npz(burst, depth_m=depth), headers=NPZ).json()
    assert (answer["outcome"], answer["category_id"]) == ("known", category["id"])
    assert answer["pose"]["target_from_reference"]["scale"] == pytest.approx(1, abs=0.05)


def test_saturated_depth_is_refused(client, look, parts):
    def full(about, files):
        measured = [cv2.imdecode(np.frombuffer(each, np.uint8), cv2.IMREAD_UNCHANGED) > 0 for each in files["depth"]]
        files["depth"] = [cv2.imencode(".png", each.astype(np.uint16) * 65535)[1].tobytes() for each in measured]

    refused(
        client.post("/v1/observations", files=parts(look(), full)), 422, "views[0].depth", "100% of what it measured is 65535", "send 0"
    )


def edited(**changes):
    """An edit of every view's camera by functions of the matrices."""

    def edit(about, files):
        for view in about["views"]:
            for name, change in changes.items():
                view[name] = change(np.array(view[name])).tolist()

    return edit


def millimetres(pose):
    pose[:3, 3] *= 1000
    return pose


CAMERAS = {
    "translations in millimetres": (edited(world_from_camera=millimetres), "views", "world_from_camera says"),
    "depth in tenths of a millimetre": (
        lambda about, files: about.update(depth_scale=0.0001),
        "views",
        "depth says that the object is 0.0",
    ),
    "focal length of 1e308": (edited(K=lambda K: K * [[1e305, 1, 1], [1, 1, 1], [1, 1, 1]]), "views[0].K", "no camera's"),
    "focal length in metres": (edited(K=lambda K: K * [[1e-5, 1, 1], [1, 1e-5, 1], [1, 1, 1]]), "views[0].K", "no camera's"),
    "a skew of 1e300": (edited(K=lambda K: K + [[0, 1e300, 0], [0, 0, 0], [0, 0, 0]]), "views[0].K", "skew"),
    "a rotation of 1e200": (edited(world_from_camera=lambda pose: pose * 1e200), "views[0].world_from_camera", "last row"),
    "a camera in the next galaxy": (
        edited(world_from_camera=lambda pose: pose + 1e22 * np.eye(4, k=3)),
        "views[0].world_from_camera",
        "from the world's origin",
    ),
    "OpenGL's axes": (edited(world_from_camera=lambda pose: pose @ np.diag([1, -1, -1, 1])), "views", "OpenGL's axes"),
    "a sheared rotation": (
        edited(world_from_camera=lambda pose: pose @ (np.eye(4) + 0.01 * np.eye(4, k=1))),
        "views[0].world_from_camera",
        "not a rotation",
    ),
}


@pytest.mark.parametrize("case", CAMERAS)
def test_cameras_that_cannot_be_are_refused(client, look, parts, case):
    edit, field, word = CAMERAS[case]
    for address in ("/v1/observations", "/v1/scans"):
        refused(client.post(address, files=parts(look(), edit)), 422, field, word)


@pytest.mark.parametrize("case", ["translations in millimetres", "OpenGL's axes"])
def test_a_scan_with_wrong_cameras_makes_no_category(client, look, parts, case):
    edit, field, word = CAMERAS[case]
    scan = client.post("/v1/observations", files=parts(look())).json()["scan"]
    assert client.post(f"/v1/scans/{scan['id']}/views", files=parts(look(), edit)).status_code == 200
    refused(client.post(f"/v1/scans/{scan['id']}/complete"), 422, field, word)
    assert client.get("/v1/categories").json()["categories"] == []


def test_cameras_at_the_same_place_are_told_of(client, look, parts, learn):
    learn()
    one = look(views=1).views[0]
    seen = client.post("/v1/observations", files=parts(Burst([one] * 4)))
    assert seen.status_code == 201
    found = seen.json()["grounds"]
    assert "within 0°" in found["weakness"]
    assert [[fault["kind"] for fault in view] for view in found["faults"]] == [[], ["copy"], ["copy"], ["copy"]]
    assert client.post("/v1/scans", json={"observation_id": seen.json()["id"]}).status_code == 201


def test_views_of_two_objects_in_one_burst_are_told_of(client, look, parts):
    other = look("dark", views=1, world_from_object=Sim3(1.0, np.eye(3), np.array([1.5, 0, 0])))
    seen = client.post("/v1/observations", files=parts(Burst(look(views=4).views + other.views))).json()
    assert [[fault["kind"] for fault in view] for view in seen["grounds"]["faults"]] == [[], [], [], [], ["elsewhere"]]
