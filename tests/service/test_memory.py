"""The memory as a whole over HTTP."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from core.calibration import LARGEST_RATE
from service.app import create_app
from service.settings import SMALLEST_RATE
from store.memory import Memory
from tests.service.conftest import learnt, lose_answers

ZIP = {"content-type": "application/zip"}


@pytest.fixture
def other(settings, backbone, tmp_path):
    """Another robot's service, with an empty memory."""
    with TestClient(create_app(settings.model_copy(update={"data_dir": tmp_path / "other"}), backbone=backbone)) as client:
        yield client


def asked(client, parts, burst):
    """What is answered about a burst, less what is new at each asking."""
    seen = client.post("/v1/observations", files=parts(burst), params={"learn": False}).json()
    return {name: seen[name] for name in ("outcome", "name", "pose")} | {
        "similarity": [each["similarity"] for each in seen["similarities"]]
    }


def test_the_memory_says_what_it_holds(client, look, parts, learn):
    before = client.get("/v1/memory").json()
    learn()
    after = client.get("/v1/memory").json()
    assert (before["categories"], before["instances"]) == (0, 0)
    assert (after["categories"], after["instances"], after["observations"], after["backbone"]) == (1, 1, 1, "colour")
    assert after["version"] > before["version"]
    assert after["size_bytes"] > before["size_bytes"]


def test_two_memories_exported_and_imported_into_each_other_answer_alike(client, other, look, parts, ball):
    learnt(other, parts(look("dark")), "stone")
    archives = [each.post("/v1/memory/export") for each in (client, other)]
    for target, archive, name in zip((other, client), archives, ("ball", "stone")):
        brought = target.post("/v1/memory/import", content=archive.content, headers=ZIP)
        assert brought.status_code == 201, brought.text
        assert [category["name"] for category in brought.json()["categories"]] == [name]
        assert (brought.json()["duplicates"], brought.json()["same_name"]) == ([], [])
    for kind in ("bright", "dark"):
        first, second = (asked(each, parts, look(kind, views=4)) for each in (client, other))
        assert first["outcome"] == "known"
        assert first == second


def test_importing_twice_brings_duplicates_only(client, other, ball):
    archive = client.post("/v1/memory/export").content
    other.post("/v1/memory/import", content=archive, headers=ZIP)
    again = other.post("/v1/memory/import", content=archive, headers=ZIP).json()
    assert again["categories"] == []
    assert [each["name"] for each in again["duplicates"]] == [ball["name"]]
    assert len(other.get("/v1/categories").json()["categories"]) == 1


def test_names_that_two_have_are_told(client, other, look, parts, ball):
    archive = client.post("/v1/memory/export").content
    learnt(other, parts(look("dark")), "ball")
    assert other.post("/v1/memory/import", content=archive, headers=ZIP).json()["same_name"] == ["ball"]


def test_a_repeated_import_is_done_once_even_if_its_answer_was_lost(client, other, ball):
    archive, headers = client.post("/v1/memory/export").content, ZIP | {"Idempotency-Key": "i1"}
    first = other.post("/v1/memory/import", content=archive, headers=headers).json()
    lose_answers(other)
    assert other.post("/v1/memory/import", content=archive, headers=headers).json() == first


def test_some_categories_can_be_exported(client, other, learn):
    _, second = learn("bright", "ball"), learn("dark", "stone")
    archive = client.post("/v1/memory/export", params={"category_id": [second["id"]]}).content
    brought = other.post("/v1/memory/import", content=archive, headers=ZIP).json()
    assert [category["name"] for category in brought["categories"]] == ["stone"]


def test_an_export_without_damaged_instances_says_so_in_the_trail(client, ball, look, parts):
    client.post("/v1/observations", files=parts(look()), params={"category_id": ball["id"]})
    with client.app.state.running.agent.memory._connection.change() as db:
        db.execute("UPDATE instances SET cls = zeroblob(4) WHERE source = 'observation'")
    assert client.post("/v1/memory/export").status_code == 200
    assert client.get("/v1/memory/audit").json()["entries"][0]["after"] == {"categories": 1, "chosen": None, "left_out": 1}


def test_what_cannot_be_exported_or_imported(client, other, learn):
    assert client.post("/v1/memory/export", params={"category_id": ["nope"]}).status_code == 404
    assert client.post("/v1/memory/export").status_code == 409
    learn()
    archive = client.post("/v1/memory/export").content
    for body in (b"", b"no zip", archive[: len(archive) // 2]):
        assert other.post("/v1/memory/import", content=body, headers=ZIP).status_code == 422
    assert other.post("/v1/memory/import", content=archive).status_code == 415
    strange = io.BytesIO()
    with zipfile.ZipFile(strange, "w") as file:
        file.writestr("../../escape", b"x")
    assert other.post("/v1/memory/import", content=strange.getvalue(), headers=ZIP).status_code == 422
    assert other.get("/v1/categories").json() == {"categories": []}


def test_a_backup_opens_as_a_memory(client, settings, ball):
    answer = client.post("/v1/memory/backup")
    assert answer.status_code == 201
    made = answer.json()
    assert (Path(made["folder"]).parent, made["damages"]) == (settings.backups, [])
    with Memory.open(Path(made["folder"])) as copy:
        assert [each.id for each in copy.categories.all()] == [ball["id"]]
    assert client.post("/v1/memory/backup").json()["folder"] != made["folder"]


def test_a_rate_is_kept_with_the_memory_and_makes_the_thresholds(settings, backbone):
    with TestClient(create_app(settings.model_copy(update={"threshold": None, "score": "best"}), backbone=backbone)) as client:
        often, seldom = (client.post("/v1/memory/calibrate", json={"false_known_rate": rate}).json() for rate in (0.2, 0.01))
        assert (often["false_known_rate"], often["decisions"]) == (0.2, 0)
        assert often["tokens"] < seldom["tokens"]
        assert often["verified"] < seldom["verified"]
        client.post("/v1/memory/calibrate", json={"false_known_rate": 0.1})
    with TestClient(create_app(settings.model_copy(update={"threshold": None, "score": "best"}), backbone=backbone)) as client:
        assert client.get("/v1/memory").json()["false_known_rate"] == client.get("/v1/info").json()["false_known_rate"] == 0.1
        default = client.post("/v1/memory/calibrate", json={"false_known_rate": None}).json()
        assert default["false_known_rate"] == settings.false_known_rate


@pytest.mark.parametrize("setting", [{"threshold": 0.5}, {"score": "paper_mean"}])
def test_a_threshold_that_is_set_is_not_made_of_a_rate(settings, backbone, setting):
    with TestClient(create_app(settings.model_copy(update=setting), backbone=backbone)) as client:
        assert client.post("/v1/memory/calibrate", json={"false_known_rate": 0.1}).status_code == 409


@pytest.mark.parametrize("rate", [0, SMALLEST_RATE / 2, LARGEST_RATE + 0.1, "often"])
def test_a_rate_is_a_share(client, rate):
    answer = client.post("/v1/memory/calibrate", json={"false_known_rate": rate})
    assert (answer.status_code, answer.json()["field"]) == (422, "false_known_rate")


def test_changes_are_told_with_who_made_them_and_can_be_taken_back(client, learn):
    path = f"/v1/categories/{learn('bright', 'ball')['id']}"
    client.patch(path, json={"name": "stone"}, headers={"X-Actor": "kim"})
    client.delete(path, headers={"X-Actor": "kim"})
    deleted, renamed, created = client.get("/v1/memory/audit").json()["entries"]
    assert [entry["action"] for entry in (deleted, renamed, created)] == ["delete", "rename", "create"]
    assert (renamed["actor"], renamed["before"], renamed["after"]) == ("kim", {"name": "ball"}, {"name": "stone"})
    undone = client.post(f"/v1/memory/audit/{deleted['id']}/undo")
    assert (undone.status_code, undone.json()["action"]) == (200, "undo")
    assert client.get(path).json()["name"] == "stone"
    assert client.post(f"/v1/memory/audit/{deleted['id']}/undo").status_code == 409
    assert client.post(f"/v1/memory/audit/{created['id']}/undo").status_code == 409
    assert client.post("/v1/memory/audit/nope/undo").status_code == 404
