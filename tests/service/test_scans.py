"""Scans over HTTP: views come one by one, survive a restart, and end in a category or in a problem that says what is missing."""

from __future__ import annotations

import numpy as np
import pytest
from fastapi.testclient import TestClient

from service.app import create_app


@pytest.fixture
def scan(client, look, parts):
    """A scan that asks for views."""
    return client.post("/v1/scans", files=parts(look())).json()


def add(client, scan, parts, burst, edit=None):
    return client.post(f"/v1/scans/{scan['id']}/views", files=parts(burst, edit))


def test_a_scan_begins_with_a_burst(scan):
    assert (scan["state"], scan["views"], scan["views_required"], scan["observation_id"]) == ("requested", 0, 2, None)
    viewpoints = np.array(scan["world_from_camera"])
    distances = np.linalg.norm(viewpoints[:, :3, 3] - scan["center_m"], axis=1)
    assert np.allclose(distances, scan["radius_m"])


def test_a_scan_begins_with_an_observation(client, look, parts):
    seen = client.post("/v1/observations", files=parts(look())).json()
    begun = client.post("/v1/scans", json={"observation_id": seen["id"]})
    assert begun.status_code == 201
    assert begun.json()["observation_id"] == seen["id"]
    assert np.allclose(begun.json()["center_m"], seen["scan"]["center_m"])


def test_views_come_one_by_one(client, scan, look, parts):
    counts = [add(client, scan, parts, look().select([index])).json()["views"] for index in range(3)]
    assert counts == [1, 2, 3]
    assert client.get(f"/v1/scans/{scan['id']}").json()["state"] == "collecting"


@pytest.mark.parametrize(("views", "missing"), [(0, 2), (1, 1)])
def test_too_few_views_say_how_many_more(client, scan, look, parts, views, missing):
    if views:
        add(client, scan, parts, look().select(range(views)))
    answer = client.post(f"/v1/scans/{scan['id']}/complete")
    problem = answer.json()
    assert (answer.status_code, problem["type"], problem["field"]) == (422, "urn:onelook:problem:too-few-views", "views")
    assert f"send {missing} more" in problem["detail"]
    assert client.get("/v1/categories").json()["categories"] == []


def test_completing_makes_a_category(client, scan, look, parts):
    add(client, scan, parts, look())
    answer = client.post(f"/v1/scans/{scan['id']}/complete", json={"name": "ball"})
    assert answer.status_code == 201
    category = answer.json()
    assert (category["name"], category["views"], category["instances"]) == ("ball", 6, 1)
    done = client.get(f"/v1/scans/{scan['id']}").json()
    assert (done["state"], done["category_id"], done["views"], done["received"]) == ("completed", category["id"], 0, [])


def test_a_completed_scan_is_closed(client, scan, look, parts):
    add(client, scan, parts, look())
    client.post(f"/v1/scans/{scan['id']}/complete")
    for answer in (client.post(f"/v1/scans/{scan['id']}/complete"), add(client, scan, parts, look())):
        assert answer.status_code == 409
        assert "is completed" in answer.json()["detail"]
    assert len(client.get("/v1/categories").json()["categories"]) == 1


@pytest.mark.parametrize("name", ["depth", "K"])
def test_a_reference_needs_depth_and_cameras(client, scan, look, parts, name):
    def without(about, files):
        files["depth"].clear()
        if name == "K":
            del about["views"]

    answer = add(client, scan, parts, look(), without)
    assert answer.status_code == 422
    assert answer.json()["field"] == f"views[0].{name}"


def test_a_deleted_scan_is_gone(client, scan, look, parts):
    assert client.delete(f"/v1/scans/{scan['id']}").status_code == 204
    for answer in (
        client.get(f"/v1/scans/{scan['id']}"),
        add(client, scan, parts, look()),
        client.post(f"/v1/scans/{scan['id']}/complete"),
    ):
        assert answer.status_code == 404
        assert answer.json()["title"] == "There is no such thing"


def test_an_unknown_observation_begins_no_scan(client):
    answer = client.post("/v1/scans", json={"observation_id": "nope"})
    assert answer.status_code == 404
    assert "'nope'" in answer.json()["detail"]


def test_a_burst_without_depth_begins_no_scan(client, look, parts):
    answer = client.post("/v1/scans", files=parts(look(), lambda about, files: files["depth"].clear()))
    assert answer.status_code == 422
    assert "no depth" in answer.json()["detail"]


def test_a_scan_survives_a_restart(settings, backbone, look, parts):
    with TestClient(create_app(settings, backbone=backbone)) as client:
        scan = client.post("/v1/scans", files=parts(look())).json()
        add(client, scan, parts, look().select([0, 1, 2]))
    with TestClient(create_app(settings, backbone=backbone)) as client:
        assert add(client, scan, parts, look().select([3, 4, 5])).json()["views"] == 6
        assert client.post(f"/v1/scans/{scan['id']}/complete").json()["views"] == 6


def test_each_accepted_view_says_which_viewpoint_it_covers(client, scan, look, parts):
    for index in (0, 3):
        scan = add(client, scan, parts, look(poses=[np.array(scan["world_from_camera"][index])])).json()
    assert [view["viewpoint"] for view in scan["received"]] == [0, 3]
    assert all(view["angle_deg"] < 1 for view in scan["received"])
    assert [index for index, covered in enumerate(scan["covered"]) if covered] == [0, 3]
    assert scan["coverage"] == pytest.approx(0.2)


def test_a_bad_view_is_accepted_with_its_faults(client, scan, look, parts):
    aside = np.array(scan["world_from_camera"][0])
    aside[:3, 3] += 0.22 * aside[:3, 0]
    answer = add(client, scan, parts, look(poses=[aside]))
    assert answer.status_code == 200
    (view,) = answer.json()["received"]
    assert "cut_off" in [fault["kind"] for fault in view["faults"]]
    assert all(fault["detail"] for fault in view["faults"])


def test_a_scan_is_as_its_options_say(client, look, parts):
    options = {"viewpoints": 20, "up": [0, 0, 2], "standoff_m": 0.9}
    scan = client.post("/v1/scans", files=parts(look()), params=options).json()
    assert (len(scan["world_from_camera"]), scan["up"], scan["up_from"], scan["radius_m"]) == (20, [0, 0, 1], "given", 0.9)


@pytest.mark.parametrize(("name", "value"), [("viewpoints", 1), ("up", [0, 1]), ("up", ["nan", 0, 1]), ("standoff_m", 0)])
def test_wrong_options_are_told(client, look, parts, name, value):
    answer = client.post("/v1/scans", files=parts(look()), params={name: value})
    assert (answer.status_code, answer.json()["field"].partition("[")[0]) == (422, name)


def test_up_without_a_direction_is_told(client, look, parts):
    answer = client.post("/v1/scans", files=parts(look()), params={"up": [0, 0, 0]})
    assert (answer.status_code, answer.json()["field"]) == (422, "up")


def test_unreachable_viewpoints_are_replaced(client, scan):
    changed = client.post(f"/v1/scans/{scan['id']}/exclude", json={"viewpoints": [1, 4]}).json()
    before, after = (np.array(each["world_from_camera"])[:, :3, 3] for each in (scan, changed))
    moved = np.linalg.norm(before - after, axis=1) > 0.01
    assert np.flatnonzero(moved).tolist() == [1, 4]
    assert changed["excluded"] == 2
    assert client.get(f"/v1/scans/{scan['id']}").json() == changed


def test_an_unknown_viewpoint_cannot_be_excluded(client, scan):
    answer = client.post(f"/v1/scans/{scan['id']}/exclude", json={"viewpoints": [99]})
    assert (answer.status_code, answer.json()["field"]) == (422, "viewpoints")


def test_a_scan_expires(settings, backbone, look, parts):
    with TestClient(create_app(settings.model_copy(update={"scan_expiry_h": 1e-6}), backbone=backbone)) as client:
        scan = client.post("/v1/scans", files=parts(look())).json()
        assert client.get(f"/v1/scans/{scan['id']}").json()["state"] == "expired"
        answer = add(client, scan, parts, look())
        assert answer.status_code == 409
        assert "expired" in answer.json()["detail"]


def test_exclusions_and_coverage_survive_a_restart(settings, backbone, look, parts):
    with TestClient(create_app(settings, backbone=backbone)) as client:
        scan = client.post("/v1/scans", files=parts(look())).json()
        client.post(f"/v1/scans/{scan['id']}/exclude", json={"viewpoints": [0]})
        add(client, scan, parts, look().select([0, 1]))
        before = client.get(f"/v1/scans/{scan['id']}").json()
    with TestClient(create_app(settings, backbone=backbone)) as client:
        assert client.get(f"/v1/scans/{scan['id']}").json() == before


def test_scans_in_progress_are_listed(client, scan, look, parts):
    other = client.post("/v1/scans", files=parts(look())).json()
    add(client, other, parts, look())
    assert [each["id"] for each in client.get("/v1/scans").json()["scans"]] == [other["id"], scan["id"]]
    client.post(f"/v1/scans/{other['id']}/complete")
    assert [each["id"] for each in client.get("/v1/scans").json()["scans"]] == [scan["id"]]
