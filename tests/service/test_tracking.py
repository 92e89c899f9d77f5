"""WS /v1/track: a pose for each frame, found and lost announced, slow sides told."""

from __future__ import annotations

import base64
import json
from dataclasses import replace

import anyio
import numpy as np
import pytest
from fastapi.testclient import TestClient
from scipy.spatial.transform import Rotation
from starlette.websockets import WebSocketDisconnect

from core.camera_poses import hemisphere
from core.sim3 import Sim3, rotation_angle_deg
from core.warm import WarmConfig
from service import tracker
from service.app import create_app
from service.routes.track import WAITING_FRAMES, Waiting
from tests.service.conftest import LONG_S, Gate, as_text

UP = np.array([0.0, 0.0, 1.0])
PLACED = Sim3(1.0, Rotation.from_euler("z", 50, degrees=True).as_matrix(), np.array([0.3, -0.1, 0.05]))
MOVED = Sim3(1.0, PLACED.rotation, np.array([0.8, 0.4, 0.05]))
SOUGHT_EACH_FRAME = WarmConfig(sought_anew_after=0)


def message(number, view, **changes):
    """One view as a frame."""
    return {
        "type": "frame",
        "id": number,
        "time_s": number / 10,
        "K": view.camera.K.tolist(),
        "world_from_camera": view.camera.world_from_camera.tolist(),
        "rgb": as_text(view.rgb[..., ::-1]),
        "depth": as_text(np.round(view.depth_m * 1000).astype(np.uint16)),
    } | changes


@pytest.fixture
def camera_round(look):
    """camera_round(placed, count): views of a camera that goes round an object."""

    def views(placed, count=6, kind="bright"):
        poses = hemisphere(placed.translation, UP, 0.5, 12)[:count]
        return look(kind, world_from_object=placed, poses=poses).views

    return views


@pytest.fixture
def track(client):
    """track(messages, hello): what is answered to messages sent one by one, each when the one before was answered."""

    def talk(messages, **hello):
        answers = []
        with client.websocket_connect("/v1/track") as socket:
            socket.send_json({"type": "hello"} | hello)
            answers.append(socket.receive_json())
            for each in messages:
                socket.send_json(each)
                answers.append(socket.receive_json())
                while answers[-1]["type"] in {"found", "lost", "dropped"}:
                    answers.append(socket.receive_json())
        return answers

    return talk


def kinds(answers):
    return [answer["type"] for answer in answers]


def test_every_frame_gets_a_pose_that_is_near_the_truth(track, ball, camera_round):
    answers = track([message(*each) for each in enumerate(camera_round(PLACED))], category_id=ball["id"])
    assert answers[0] == {"type": "ready", "category_id": ball["id"], "window": 5, "weight": 0.5}
    assert kinds(answers[1:]) == ["found"] + ["pose"] * 6
    assert [answer["frame_id"] for answer in answers[2:]] == [0, 1, 2, 3, 4, 5]
    assert [answer["views"] for answer in answers[2:]] == [1, 2, 3, 4, 5, 5]
    last = answers[-1]["pose"]
    matrix = np.array(last["target_from_reference"]["matrix"])
    assert rotation_angle_deg(matrix[:3, :3] / last["target_from_reference"]["scale"], PLACED.rotation) < 5
    assert np.linalg.norm(np.array(last["world_from_object"])[:2, 3] - PLACED.translation[:2]) < 0.02
    assert answers[-1]["measured"]
    assert answers[-1]["latency_ms"] > 0


def test_the_age_of_a_pose_is_told(track, ball, camera_round):
    views = [message(*each) for each in enumerate(camera_round(PLACED))]
    plain = track(views, category_id=ball["id"], weight=1)
    assert [answer["data_age_s"] for answer in plain[2:]] == pytest.approx([0, 0.05, 0.1, 0.15, 0.2, 0.2])
    smoothed = track(views, category_id=ball["id"], weight=0.25)
    assert smoothed[-1]["data_age_s"] > plain[-1]["data_age_s"]
    assert track(views, category_id=ball["id"], weight=1, window=1)[-1]["data_age_s"] == 0


def test_the_category_is_decided_where_hello_names_none(track, ball, camera_round):
    answers = track([message(*each) for each in enumerate(camera_round(PLACED, 3))], window=3)
    assert answers[0]["category_id"] is None
    decided = next(answer for answer in answers if answer["type"] == "pose")
    assert (decided["outcome"], decided["similarities"][0]["name"]) == ("known", "ball")
    assert answers[-1]["category_id"] == ball["id"]
    assert (answers[-1]["outcome"], answers[-1]["similarities"]) == (None, [])


def test_an_object_of_no_category_gets_no_pose(track, ball, camera_round):
    answers = track([message(*each) for each in enumerate(camera_round(PLACED, 2, "dark"))])
    assert kinds(answers[1:]) == ["pose", "pose"]
    assert answers[-1]["pose"] is None
    assert (answers[-1]["outcome"], "no category" in answers[-1]["reason"]) == ("novel", True)


def test_a_lost_object_is_held_for_a_while_then_announced_and_found_again(track, ball, camera_round):
    seen = camera_round(PLACED, 3)
    blank = [message(number, seen[0], rgb=as_text(np.zeros((160, 160, 3), np.uint8))) for number in (3, 4, 5)]
    frames = [*(message(*each) for each in enumerate(seen)), *blank, message(6, seen[0])]
    answers = track(frames, category_id=ball["id"])
    assert kinds(answers[1:]) == ["found", "pose", "pose", "pose", "pose", "pose", "lost", "pose", "found", "pose"]
    held, last_blank = answers[5], answers[8]
    assert (held["measured"], held["pose"] is not None, held["reason"] is not None) == (False, True, True)
    assert held["data_age_s"] > answers[4]["data_age_s"]
    assert (last_blank["pose"], last_blank["data_age_s"]) == (None, None)


def test_a_moved_object_is_followed_once_its_new_place_is_sure(track, ball, camera_round):
    views = [*camera_round(PLACED, 4), *camera_round(MOVED, 10)]
    answers = [
        each for each in track([message(*each) for each in enumerate(views)], category_id=ball["id"], window=3) if each["type"] == "pose"
    ]
    places = np.array([answer["pose"]["world_from_object"] for answer in answers])[:, :2, 3]
    assert np.linalg.norm(places[3] - PLACED.translation[:2]) < 0.03
    assert np.linalg.norm(places[-1] - MOVED.translation[:2]) < 0.03
    assert not all(answer["measured"] for answer in answers[4:])


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"rgb": "no base64!"}, "rgb"),
        ({"rgb": base64.b64encode(b"no image").decode()}, "rgb"),
        ({"K": None}, "K"),
        ({"K": [[-1, 0, 0], [0, 1, 0], [0, 0, 1]]}, "K"),
        ({"depth_scale": 1000}, "depth"),
        ({"world_from_camera": [[1, 2], [3, 4]]}, "world_from_camera"),
        ({"time_s": -1}, "time_s"),
        ({"surprise": 1}, "surprise"),
    ],
)
def test_a_frame_that_cannot_be_used_is_told_and_the_next_is_answered(track, ball, camera_round, changes, field):
    views = camera_round(PLACED, 3)
    answers = track([message(0, views[0]), message(1, views[1], **changes), message(2, views[2])], category_id=ball["id"])
    problem = answers[3]
    assert (problem["type"], problem["problem"]["status"], problem["problem"]["field"]) == ("problem", 422, field)
    assert (answers[4]["type"], answers[4]["frame_id"]) == ("pose", 2)


@pytest.mark.parametrize(
    ("hello", "status"),
    [({"type": "frame"}, 422), ({"category_id": "nope"}, 404), ({"variant": "nonsense"}, 422), ({"window": 0}, 422), ({"weight": 0}, 422)],
)
def test_a_wrong_hello_is_refused(client, hello, status):
    with client.websocket_connect("/v1/track") as socket:
        socket.send_json({"type": "hello"} | hello)
        problem = socket.receive_json()
        with pytest.raises(WebSocketDisconnect) as closed:
            socket.receive_json()
    assert (problem["type"], problem["problem"]["status"], closed.value.code) == ("problem", status, 1008)


def test_no_more_are_followed_than_set(settings, backbone):
    with TestClient(create_app(settings.model_copy(update={"max_tracks": 1}), backbone=backbone)) as client:
        with client.websocket_connect("/v1/track") as first:
            first.send_json({"type": "hello"})
            assert first.receive_json()["type"] == "ready"
            with client.websocket_connect("/v1/track") as second:
                assert "ONELOOK_MAX_TRACKS" in second.receive_json()["problem"]["detail"]
        with client.websocket_connect("/v1/track") as third:
            third.send_json({"type": "hello"})
            assert third.receive_json()["type"] == "ready"


def test_who_does_not_say_hello_holds_no_place(settings, backbone):
    few = settings.model_copy(update={"max_tracks": 1, "deadline_s": 1.0})
    with TestClient(create_app(few, backbone=backbone)) as client:
        with client.websocket_connect("/v1/track") as silent:
            problem = silent.receive_json()["problem"]
            assert (problem["status"], "ONELOOK_DEADLINE_S" in problem["detail"]) == (503, True)
            with pytest.raises(WebSocketDisconnect):
                silent.receive_json()
        with client.websocket_connect("/v1/track") as second:
            second.send_json({"type": "hello"})
            assert second.receive_json()["type"] == "ready"


def test_frames_that_come_too_fast_are_dropped_oldest_first_and_told(settings, backbone, look, parts, camera_round):
    gate, views = Gate(backbone), camera_round(PLACED, 8)
    with TestClient(create_app(settings, backbone=gate)) as client, client.websocket_connect("/v1/track") as socket:
        socket.send_json({"type": "hello"})
        socket.receive_json()
        socket.send_json(message(0, views[0]))
        gate.entered.wait(LONG_S)
        for number in range(1, 8):
            socket.send_json(message(number, views[number]))
        socket.send_text(json.dumps({"type": "end"}))  # answered at once, so all frames have arrived then
        assert socket.receive_json()["type"] == "problem"
        gate.open.set()
        answers = [socket.receive_json() for _ in range(4)]
    assert (answers[0]["type"], answers[0]["frame_id"]) == ("pose", 0)
    assert answers[1] == {"type": "dropped", "frames": 7 - WAITING_FRAMES, "first_id": 1, "last_id": 7 - WAITING_FRAMES}
    assert [answer["frame_id"] for answer in answers[2:]] == [6, 7]


def test_what_waits_is_bounded():
    async def flood():
        waiting = Waiting()
        for number in range(1000):
            waiting.put(type("Message", (), {"id": number})(), 0.0)
        assert len(waiting.messages) == WAITING_FRAMES
        assert (waiting.dropped.frames, waiting.dropped.first_id, waiting.dropped.last_id) == (998, 0, 997)
        taken = [await waiting.take() for _ in range(WAITING_FRAMES)]
        assert [each[0].id for each in taken] == [998, 999]
        waiting.close()
        assert await waiting.take() is None

    anyio.run(flood)


def test_a_frame_that_was_taken_and_refused_is_told_in_order_with_those_dropped_meanwhile():
    waiting = Waiting()
    for number in (1, 2, 0):
        waiting.drop(number)
    assert (waiting.dropped.frames, waiting.dropped.first_id, waiting.dropped.last_id) == (3, 0, 2)


@pytest.fixture
def solves(monkeypatch):
    """Frames for which the pose was sought anew."""
    sought = []
    estimate = tracker.PoseEstimator.estimate

    def counted(self, *args, **options):
        sought.append(args)
        return estimate(self, *args, **options)

    monkeypatch.setattr(tracker.PoseEstimator, "estimate", counted)
    return sought


def test_an_object_is_followed_from_its_last_pose_without_seeking_it(track, ball, camera_round, solves):
    answers = track([message(*each) for each in enumerate(camera_round(PLACED, 9))], category_id=ball["id"], window=2)
    assert len(solves) <= 4  # the window is full with the second frame
    assert all(answer["measured"] for answer in answers[2:])
    matrix = answers[-1]["pose"]["target_from_reference"]
    assert rotation_angle_deg(np.array(matrix["matrix"])[:3, :3] / matrix["scale"], PLACED.rotation) < 5


def test_an_object_that_jumped_is_sought_anew(track, ball, camera_round, solves):
    track([message(*each) for each in enumerate(camera_round(PLACED, 6))], category_id=ball["id"], window=2)
    before = len(solves)
    views = [*camera_round(PLACED, 6), *camera_round(MOVED, 6)]
    answers = track([message(*each) for each in enumerate(views)], category_id=ball["id"], window=2)
    assert len(solves) - before > before
    assert np.linalg.norm(np.array(answers[-1]["pose"]["world_from_object"])[:2, 3] - MOVED.translation[:2]) < 0.03


def test_what_is_followed_for_long_is_sought_anew(client, track, ball, camera_round, solves):
    client.app.state.running = replace(client.app.state.running, warm=SOUGHT_EACH_FRAME)
    track([message(*each) for each in enumerate(camera_round(PLACED, 5))], category_id=ball["id"], window=2)
    assert len(solves) == 5


def test_a_solve_that_lays_the_object_on_worse_than_the_last_pose_is_not_believed(client, track, ball, camera_round, monkeypatch):
    estimate = tracker.PoseEstimator.estimate
    count = [0]

    def misled(self, *args, **options):
        found = estimate(self, *args, **options)
        count[0] += 1
        upside_down = Sim3(1.0, Rotation.from_euler("x", 180, degrees=True).as_matrix(), np.zeros(3))
        return found if count[0] < 3 else replace(found, target_from_reference=found.target_from_reference @ upside_down)

    monkeypatch.setattr(tracker.PoseEstimator, "estimate", misled)
    client.app.state.running = replace(client.app.state.running, warm=SOUGHT_EACH_FRAME)
    answers = track([message(*each) for each in enumerate(camera_round(PLACED, 9))], category_id=ball["id"], window=3)
    assert count == [9]
    last = answers[-1]["pose"]["target_from_reference"]
    assert rotation_angle_deg(np.array(last["matrix"])[:3, :3] / last["scale"], PLACED.rotation) < 10
