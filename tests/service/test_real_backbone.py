"""Over real HTTP with the embedded backbone on recorded objects: learn one, know it elsewhere, tell another apart; and every endpoint."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace

import cv2
import httpx
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from websockets.sync.client import connect

from core.sim3 import Sim3, rotation_angle_deg
from core.views import Burst, Camera
from service.app import create_app
from service.settings import Settings

MOVED = Sim3(1.2, Rotation.from_rotvec([0.5, -0.8, 0.3]).as_matrix(), np.array([0.3, 0.1, -0.4]))


@pytest.fixture(scope="module")
def called():
    """(method, path) of every request."""
    return []


@pytest.fixture(scope="module")
def http(serving, embedded_backbone, tmp_path_factory, called):
    """A client of a live service with its real backbone; it raises for what is refused."""
    folder = tmp_path_factory.mktemp("real") / "memory"

    def note(answer):
        answer.read() if "stream" not in answer.headers["content-type"] else None
        called.append((answer.request.method, answer.request.url.path))
        assert answer.status_code < 400, f"{answer.request.url}: {answer.text}"

    with (
        serving(Settings(data_dir=folder, variant="ucd"), embedded_backbone) as url,
        httpx.Client(base_url=url, timeout=120, event_hooks={"response": [note]}) as client,
    ):
        yield client


@pytest.fixture(scope="module")
def scanned(recorded):
    """What the category is learnt from."""
    return recorded("tv/tv_1", range(0, 12, 3))


@pytest.fixture(scope="module")
def category(http, parts, scanned):
    """It, once learnt: looked at, found novel, scanned view by view."""
    novel = http.post("/v1/observations", files=parts(scanned.select([0, 2]))).json()
    assert novel["outcome"] == "novel"
    for view in range(len(scanned)):
        http.post(f"/v1/scans/{novel['scan']['id']}/views", files=parts(scanned.select([view])))
    return http.post(f"/v1/scans/{novel['scan']['id']}/complete", json={"name": "tv"}).json()


@pytest.fixture(scope="module")
def seen(http, parts, scanned, category):
    """The same object, turned, shifted and larger."""
    return http.post("/v1/observations", files=parts(moved(scanned))).json()


def moved(burst):
    """The same views in a world that is turned, shifted and larger."""

    def view(each):
        pose = np.eye(4)
        pose[:3, :3] = MOVED.rotation @ each.camera.world_from_camera[:3, :3]
        pose[:3, 3] = MOVED.apply(each.camera.world_from_camera[:3, 3])
        return replace(each, depth_m=each.depth_m * np.float32(MOVED.scale), camera=Camera(each.camera.K, pose))

    return Burst([view(each) for each in burst.views])


def test_learn_one_know_it_elsewhere_tell_another_apart(http, parts, recorded, category, seen):
    assert (seen["outcome"], seen["category_id"]) == ("known", category["id"])
    found = Sim3.from_matrix(np.array(seen["pose"]["target_from_reference"]["matrix"]))
    assert rotation_angle_deg(found.rotation, MOVED.rotation) < 1
    assert found.scale == pytest.approx(MOVED.scale, rel=0.01)
    other = http.post("/v1/observations", files=parts(recorded("car/car_baja-bug", range(0, 12, 6))), params={"learn": False}).json()
    assert other["outcome"] != "known"


def test_a_frame_is_tracked(http, category, scanned):
    view = scanned.views[0]
    images = {"rgb": view.rgb[..., ::-1], "depth": np.round(view.depth_m * 1000).astype(np.uint16)}
    frame = {name: base64.b64encode(cv2.imencode(".png", image)[1].tobytes()).decode() for name, image in images.items()}
    frame |= {"K": view.camera.K.tolist(), "world_from_camera": view.camera.world_from_camera.tolist()}
    with connect(f"{http.base_url}/v1/track".replace("http", "ws", 1)) as socket:
        socket.send(json.dumps({"type": "hello", "category_id": category["id"]}))
        socket.send(json.dumps({"type": "frame", "id": 7} | frame))
        answers = [json.loads(socket.recv(timeout=60)) for _ in range(3)]
    assert [answer["type"] for answer in answers] == ["ready", "found", "pose"]
    found = Sim3.from_matrix(np.array(answers[2]["pose"]["target_from_reference"]["matrix"]))
    assert rotation_angle_deg(found.rotation, np.eye(3)) < 2


def test_every_endpoint_answers(http, called, parts, scanned, category, seen):
    two, path = parts(scanned.select([0, 2])), f"/v1/categories/{category['id']}"
    picture = re.compile(r"image/png$")
    for name in ("rgb", "depth", "mask", "saliency", "foreground", "pca", "overlay"):
        assert picture.match(http.get(f"{path}/views/1/{name}.png").headers["content-type"])
    for name in ("rgb", "foreground", "pca", "overlay", "correspondences"):
        assert picture.match(http.get(f"/v1/observations/{seen['id']}/{name}.png").headers["content-type"])
    assert http.get(f"/v1/observations/{seen['id']}").json() == seen
    for read in (
        "/v1/observations",
        "/v1/categories",
        path,
        f"{path}/cloud.ply",
        f"{path}/similarity",
        "/v1/memory",
        "/v1/info",
        "/v1/scans",
    ):
        http.get(read)
    for probe in ("/healthz", "/readyz", "/metrics"):
        http.get(probe)
    http.patch(path, json={"name": "screen"})
    http.post(f"/v1/memory/audit/{http.get('/v1/memory/audit').json()['entries'][0]['id']}/undo")
    assert http.get(path).json()["name"] == "tv"
    scan = http.post("/v1/scans", json={"observation_id": seen["id"]}, params={"viewpoints": 20}).json()
    http.post(f"/v1/scans/{scan['id']}/exclude", json={"viewpoints": [0]})
    assert len(http.get(f"/v1/scans/{scan['id']}").json()["world_from_camera"]) == 20
    http.delete(f"/v1/scans/{scan['id']}")
    goal = http.post(f"{path}/goals", files=two, params={"anchor": "base"}).json()
    assert http.get(f"{path}/goals").json()["goals"] == [http.get(f"/v1/goals/{goal['id']}").json()]
    plan = http.post(f"/v1/goals/{goal['id']}/plan", json={"observation_id": seen["id"]}, params={"up": [0, 0, 1]}).json()
    turn = np.array(plan["goal_from_current"]["matrix"])[:3, :3]
    assert rotation_angle_deg(turn, MOVED.rotation.T) < 6
    http.delete(f"/v1/goals/{goal['id']}")
    named = http.post("/v1/observations", files=two, params={"category_id": category["id"]}).json()
    instance = http.get(f"{path}/instances").json()["instances"][-1]
    assert instance["source_id"] == named["id"]
    http.post(f"/v1/observations/{named['id']}/correct", json={"category_id": None})
    http.post(f"/v1/memory/audit/{http.get('/v1/memory/audit').json()['entries'][0]['id']}/undo")
    split = http.post(f"{path}/split", json={"instance_ids": [instance["id"]]}).json()
    http.post(f"{path}/merge", json={"from": split["id"]})
    http.delete(f"{path}/instances/{instance['id']}")
    http.post("/v1/memory/calibrate", json={"false_known_rate": 0.02})
    http.post("/v1/memory/backup")
    archive = http.post("/v1/memory/export").content
    duplicates = http.post("/v1/memory/import", content=archive, headers={"content-type": "application/zip"}).json()["duplicates"]
    assert [each["id"] for each in duplicates] == [category["id"]]
    with http.stream("GET", "/v1/events", params={"after": 0}) as events:
        assert next(events.iter_lines()).startswith("event: ")
    http.delete(path)
    paths = create_app(Settings()).openapi()["paths"]
    endpoints = {(method.upper(), template) for template, methods in paths.items() for method in methods}
    visited = {
        (method, template) for method, template in endpoints for verb, asked in called if verb == method and matches(template, asked)
    }
    assert endpoints - visited == set()


def matches(template, path):
    """Whether a path is of an OpenAPI path template."""
    return re.fullmatch(re.sub(r"\{\w+\}", "[^/]+", re.escape(template).replace(r"\{", "{").replace(r"\}", "}")), path) is not None
