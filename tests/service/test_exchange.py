"""Repeated writes are not done again, unchanged reads are not sent again."""

from __future__ import annotations

import re
import threading
from datetime import datetime, timedelta, timezone
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from service.app import create_app
from service.exchange import CLOCKED, MemoryRoute
from service.guarded import GuardedRoute
from service.routes.install import MADE, ROUTERS
from store import audit, scans
from tests.service.conftest import LONG_S, Gate, lose_answers

ROOT = Path(__file__).parents[2]
KEY = {"Idempotency-Key": "4f1c"}


def observations(client):
    return client.get("/v1/observations").json()["observations"]


def test_a_repeated_observation_is_answered_again_and_kept_once(client, look, parts):
    files = parts(look())
    first, again = (client.post("/v1/observations", files=files, headers=KEY) for _ in range(2))  # each with a boundary of its own
    assert (first.status_code, again.status_code) == (201, 201)
    assert again.json() == first.json()
    assert again.headers["content-type"] == first.headers["content-type"]
    assert ("idempotency-replayed" in first.headers, again.headers["idempotency-replayed"]) == (False, "true")
    assert len(observations(client)) == 1


def test_a_retry_never_makes_two_categories(client, look, parts):
    scan = client.post("/v1/scans", files=parts(look())).json()
    client.post(f"/v1/scans/{scan['id']}/views", files=parts(look()))
    answers = [client.post(f"/v1/scans/{scan['id']}/complete", json={"name": "ball"}, headers=KEY) for _ in range(3)]
    assert {answer.status_code for answer in answers} == {201}
    assert len({answer.json()["id"] for answer in answers}) == 1
    assert len(client.get("/v1/categories").json()["categories"]) == 1


def test_a_key_with_another_body_is_a_conflict(client, look, parts):
    client.post("/v1/observations", files=parts(look()), headers=KEY)
    answer = client.post("/v1/observations", files=parts(look("dark")), headers=KEY)
    assert answer.status_code == 409
    assert "new key" in answer.json()["detail"]


def test_a_key_with_other_options_is_a_conflict(client, look, parts):
    client.post("/v1/observations", files=parts(look()), headers=KEY)
    assert client.post("/v1/observations", files=parts(look()), headers=KEY, params={"seed": 1}).status_code == 409


def test_another_key_is_another_request(client, look, parts):
    for key in ("a", "b"):
        client.post("/v1/observations", files=parts(look()), headers={"Idempotency-Key": key})
    assert len(observations(client)) == 2


def test_a_refused_request_may_be_mended_under_its_key(client, look, parts):
    wrong = client.post("/v1/observations", files=parts(look()), params={"variant": "nonsense"}, headers=KEY)
    assert wrong.status_code == 422
    assert client.post("/v1/observations", files=parts(look()), headers=KEY).status_code == 201


@pytest.mark.parametrize("key", ["", "k" * 201])
def test_a_key_has_a_length(client, look, parts, key):
    answer = client.post("/v1/observations", files=parts(look()), headers={"Idempotency-Key": key})
    assert (answer.status_code, answer.json()["field"]) == (422, "Idempotency-Key")


def test_a_restarted_service_knows_the_key(settings, backbone, look, parts):
    files, answers = parts(look()), []
    for _ in range(2):
        with TestClient(create_app(settings, backbone=backbone)) as client:
            answers.append(client.post("/v1/observations", files=files, headers=KEY).json())
    assert answers[0] == answers[1]


def test_an_answer_lost_with_the_process_is_made_again_from_what_was_kept(client, look, parts):
    first = client.post("/v1/observations", files=parts(look()), headers=KEY).json()
    lose_answers(client)
    again = client.post("/v1/observations", files=parts(look()), headers=KEY)
    assert (again.status_code, again.json()) == (200, first)
    assert len(observations(client)) == 1


@pytest.mark.parametrize(("asked", "told"), [({"format": "vision_msgs"}, "detections"), ({"include": "debug"}, "debug")])
def test_an_answer_lost_with_the_process_comes_again_in_the_shape_that_was_asked_for(client, ball, look, parts, asked, told):
    asked |= {"category_id": ball["id"]}
    first = client.post("/v1/observations", files=parts(look()), params=asked, headers=KEY).json()
    lose_answers(client)
    again = client.post("/v1/observations", files=parts(look()), params=asked, headers=KEY)
    assert first[told]
    assert (again.status_code, again.json()) == (200, first)


def test_whatever_is_made_can_be_answered_again():
    made = {
        route.path_format for router in ROUTERS for route in router.routes if isinstance(route, MemoryRoute) and route.status_code == 201
    }
    assert "/v1/observations" in made
    assert made - set(MADE) == set(), "each needs an entry in the MADE of its file, and the store is told what it `made`"


def test_a_plan_lost_with_the_process_is_made_anew_once(client, learn, look, parts):
    goal = client.post(f"/v1/categories/{learn()['id']}/goals", files=parts(look())).json()
    path = f"/v1/goals/{goal['id']}/plan"
    first = client.post(path, files=parts(look()), headers=KEY).json()
    lose_answers(client)
    again = client.post(path, files=parts(look()), headers=KEY)
    assert (again.status_code, again.json()["goal_from_current"]) == (200, first["goal_from_current"])
    assert client.post(path, files=parts(look()), headers=KEY).json()["observation_id"] == again.json()["observation_id"]


def test_a_goal_whose_process_ended_after_its_observation_is_made_at_the_repetition(client, ball, look, parts, monkeypatch):
    path, goals = f"/v1/categories/{ball['id']}/goals", client.app.state.running.agent.memory.goals

    def ended(*about, **more):
        raise RuntimeError

    with monkeypatch.context() as patch:
        patch.setattr(goals, "create", ended)
        with pytest.raises(RuntimeError):
            client.post(path, files=parts(look()), headers=KEY)
    again = client.post(path, files=parts(look()), headers=KEY)
    assert (again.status_code, client.get(path).json()["goals"]) == (201, [again.json()])


def test_the_same_request_twice_at_once_is_done_once(settings, backbone, look, parts):
    gate = Gate(backbone)
    with TestClient(create_app(settings, backbone=gate)) as client:
        files, answers = parts(look()), []
        first = threading.Thread(target=lambda: answers.append(client.post("/v1/observations", files=files, headers=KEY)))
        first.start()
        gate.entered.wait(LONG_S)
        meanwhile = client.post("/v1/observations", files=files, headers=KEY)
        gate.open.set()
        first.join()
        assert (meanwhile.status_code, meanwhile.headers["retry-after"]) == (409, "1")
        assert answers[0].status_code == 201
        assert len(observations(client)) == 1


def test_an_unchanged_read_is_not_sent_again(client, ball):
    for path in (
        "/v1/categories",
        f"/v1/categories/{ball['id']}",
        f"/v1/categories/{ball['id']}/views/0/pca.png",
        "/v1/observations",
    ):
        answer = client.get(path)
        unchanged = client.get(path, headers={"If-None-Match": answer.headers["etag"]})
        assert (unchanged.status_code, unchanged.content) == (304, b""), path


def test_the_page_names_the_reads_that_have_no_tag():
    reads = [route for router in ROUTERS for route in router.routes if isinstance(route, GuardedRoute) and "GET" in route.methods]
    untagged = {route.path for route in reads if route.path.startswith("/v1/") and not isinstance(route, MemoryRoute)}
    paragraph = (ROOT / "docs" / "http.md").read_text().partition("**Reading again.**")[2].partition("\n\n")[0]
    assert untagged == set(re.findall(r"`(/v1/\w+)`", paragraph))


def test_a_change_makes_another_tag(client, learn):
    path = f"/v1/categories/{learn()['id']}"
    before = client.get(path).headers["etag"]
    client.patch(path, json={"name": "ball"})
    after = client.get(path, headers={"If-None-Match": before})
    assert (after.status_code, after.json()["name"]) == (200, "ball")
    assert after.headers["etag"] != before


def test_after_a_start_the_memory_may_be_another_one_of_the_same_version(settings, backbone):
    def of_memory(name):
        with TestClient(create_app(settings.model_copy(update={"data_dir": settings.data_dir / name}), backbone=backbone)) as client:
            version = client.get("/v1/memory").json()["version"]
            return version, client.get("/v1/categories").headers["etag"]

    (version, tag), (same_version, other_tag) = of_memory("first"), of_memory("second")
    assert version == same_version
    assert tag != other_tag


def in_two_months(monkeypatch):
    """Sets the clock of scans and of undoing forward; nobody prunes."""
    later = datetime.now(timezone.utc) + timedelta(days=60)
    monkeypatch.setattr(scans, "now", later.isoformat)
    monkeypatch.setattr(audit, "ago", lambda span: (later - span).isoformat())


def test_a_scan_that_expired_is_sent_again_before_it_is_pruned(client, look, parts, monkeypatch):
    seen = client.post("/v1/observations", files=parts(look())).json()
    paths = {
        f"/v1/scans/{seen['scan']['id']}": lambda answer: answer["state"] == "expired",
        "/v1/scans": lambda answer: answer["scans"] == [],
        f"/v1/observations/{seen['id']}": lambda answer: answer["scan"]["state"] == "expired",
        "/v1/observations": lambda answer: answer["observations"][0]["scan"]["state"] == "expired",
    }
    tags = {path: client.get(path).headers["etag"] for path in paths}
    for path, tag in tags.items():
        assert client.get(path, headers={"If-None-Match": tag}).status_code == 304, path
    in_two_months(monkeypatch)
    for path, over in paths.items():
        again = client.get(path, headers={"If-None-Match": tags[path]})
        assert (again.status_code, over(again.json())) == (200, True), path
        assert again.headers["etag"] != tags[path]


def test_a_change_that_can_no_longer_be_undone_is_sent_again(client, ball, monkeypatch):
    client.patch(f"/v1/categories/{ball['id']}", json={"name": "globe"})
    first = client.get("/v1/memory/audit", params={"limit": 1})
    assert first.json()["entries"][0]["undoable"]
    in_two_months(monkeypatch)
    again = client.get("/v1/memory/audit", params={"limit": 1}, headers={"If-None-Match": first.headers["etag"]})
    assert (again.status_code, again.json()["entries"][0]["undoable"]) == (200, False)


def test_what_time_changes_are_reads_of_the_memory():
    reads = {route.name for router in ROUTERS for route in router.routes if isinstance(route, MemoryRoute) and "GET" in route.methods}
    assert reads >= CLOCKED
