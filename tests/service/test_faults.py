"""What the service answers when the machine below it fails: never a 500, nothing lost, the reason in /readyz, and work again after it."""

from __future__ import annotations

import errno

import pytest
from fastapi.testclient import TestClient

from service import app as application
from service.app import create_app
from store.memory import Memory
from tests.faults import Disk, failing, tapped

ONCE = {"Idempotency-Key": "once"}


class Ailing:
    """A backbone that fails as it is told."""

    def __init__(self, backbone):
        self._backbone = backbone
        self.error = None

    def __getattr__(self, name):
        return getattr(self._backbone, name)

    def extract(self, images):
        if self.error is not None:
            raise self.error
        return self._backbone.extract(images)


@pytest.fixture
def ailing(backbone):
    return Ailing(backbone)


@pytest.fixture
def disk(settings):
    with tapped(Disk(settings.data_dir)) as disk:
        yield disk


@pytest.fixture
def client(disk, settings, ailing):
    with TestClient(create_app(settings, backbone=ailing), raise_server_exceptions=False) as opened:
        yield opened


def unavailable(answer, *words):
    problem = answer.json()
    assert (answer.status_code, problem["type"]) == (503, "urn:onelook:problem:unavailable"), answer.text
    assert "Traceback" not in answer.text
    for word in words:
        assert word in problem["detail"]


@pytest.mark.parametrize(("error", "said"), [(errno.ENOSPC, "No space left"), (errno.EIO, "Input/output error")])
def test_a_disk_that_takes_nothing_is_told_of_and_the_robot_loses_nothing(client, disk, look, parts, learn, error, said):
    category = learn()
    burst = parts(look(views=4))
    disk.fault = failing(error, "write", "fsync")
    unavailable(client.post("/v1/observations", files=burst, headers=ONCE), said, "free space")
    unavailable(client.get("/readyz"), said)
    assert client.get("/healthz").status_code == 200
    assert client.get(f"/v1/categories/{category['id']}").json()["instances"] == 1
    assert client.get(f"/v1/categories/{category['id']}/views/0/rgb.png").status_code == 200
    disk.fault = lambda kind, path: None
    assert client.get("/readyz").status_code == 200
    again = client.post("/v1/observations", files=burst, headers=ONCE)
    assert (again.status_code, again.json()["outcome"]) == (201, "known")
    assert client.get(f"/v1/categories/{category['id']}").json()["instances"] == 2


def test_a_commit_that_fails_is_told_of_and_its_repetition_is_done_once(client, disk, look, parts):
    burst = parts(look())
    disk.fault = failing(errno.ENOSPC, "commit")
    unavailable(client.post("/v1/observations", files=burst, headers=ONCE), "full")
    unavailable(client.get("/readyz"), "full")
    disk.fault = lambda kind, path: None
    first = client.post("/v1/observations", files=burst, headers=ONCE)
    assert first.status_code == 201
    assert client.post("/v1/observations", files=burst, headers=ONCE).json()["id"] == first.json()["id"]
    assert len(client.get("/v1/observations").json()["observations"]) == 1


def test_an_answer_that_cannot_be_kept_is_given_again_by_what_was_made(client, disk, look, parts):
    """The disk fills up between the change and the note of its answer."""
    burst = parts(look())
    commits = []

    def full_after_the_change(kind, path):
        commits.extend([kind] if kind == "commit" else [])
        if len(commits) == 3:  # the key's, the change's, the answer's
            failing(errno.ENOSPC, "commit")(kind, path)

    disk.fault = full_after_the_change
    unavailable(client.post("/v1/observations", files=burst, headers=ONCE))
    disk.fault = lambda kind, path: None
    again = client.post("/v1/observations", files=burst, headers=ONCE)
    assert (again.status_code, again.headers["Idempotency-Replayed"]) == (200, "true")
    assert [each["id"] for each in client.get("/v1/observations").json()["observations"]] == [again.json()["id"]]


@pytest.mark.parametrize("error", [RuntimeError("secret of the driver"), MemoryError("secret size"), SystemExit(1)])
def test_a_backbone_that_fails_or_is_ended_is_told_of_and_works_again(client, ailing, look, parts, error):
    burst = parts(look())
    ailing.error = error
    failed = client.post("/v1/observations", files=burst, headers=ONCE)
    unavailable(failed)
    assert "secret" not in failed.text
    if isinstance(error, Exception):
        unavailable(client.get("/readyz"), "the backbone colour failed")
    ailing.error = None
    assert client.get("/readyz").status_code == 200
    assert client.post("/v1/observations", files=burst, headers=ONCE).status_code == 201


def test_a_request_that_memory_does_not_suffice_for_fails_alone(client, look, parts, monkeypatch):
    def large(*args):
        raise MemoryError

    with monkeypatch.context() as patch:
        patch.setattr("service.deps.decode_parts", large)
        unavailable(client.post("/v1/observations", files=parts(look())), "out of memory", "fewer or smaller views")
    assert client.post("/v1/observations", files=parts(look())).status_code == 201


def test_a_full_disk_for_temporary_files_is_told_of(client, look, parts, monkeypatch):
    def full(*args, **options):
        raise OSError(errno.ENOSPC, "No space left on device", "/tmp/x")

    with monkeypatch.context() as patch:
        patch.setattr("service.deps.MultiPartParser.parse", full)
        unavailable(client.post("/v1/observations", files=parts(look())), "No space left on device")
    assert client.post("/v1/observations", files=parts(look())).status_code == 201


@pytest.mark.parametrize("damage", ["flipped", "cut", "empty", "gone"])
def test_damaged_files_are_named_where_they_are_asked_for_and_stop_nothing_else(client, settings, look, parts, learn, damage):
    category, other = learn("bright", "a"), learn("dark", "b")
    for path in (settings.data_dir / "categories" / category["id"]).iterdir():
        content = bytearray(path.read_bytes())
        content[len(content) // 2] ^= 1
        path.write_bytes({"flipped": bytes(content), "cut": bytes(content[: len(content) // 2]), "empty": b"", "gone": b""}[damage])
        if damage == "gone":
            path.unlink()
    pictures = ("rgb", "depth", "mask", "saliency", "foreground", "pca", "overlay")
    documented = client.get("/openapi.json").json()["paths"]
    for address in (*(f"views/0/{kind}.png" for kind in pictures), "cloud.ply"):
        assert "503" in documented[f"/v1/categories/{{category_id}}/{address.replace('0', '{view}')}"]["get"]["responses"]
        unavailable(client.get(f"/v1/categories/{category['id']}/{address}"), "restore it from a backup")
        assert client.get(f"/v1/categories/{other['id']}/{address}").status_code == 200
    seen = client.post("/v1/observations", files=parts(look("bright", views=4))).json()
    assert (seen["outcome"], seen["category_id"], seen["pose"]) == ("known", category["id"], None)
    assert "restore it from a backup" in seen["pose_error"]
    assert client.post("/v1/observations", files=parts(look("dark", views=4))).json()["pose"] is not None
    unavailable(client.post("/v1/memory/export"), "damaged")
    assert client.post("/v1/memory/export", params={"category_id": other["id"]}).status_code == 200


def test_damaged_features_of_an_observation_are_told_as_documented(client, settings, look, parts):
    seen = client.post("/v1/observations", files=parts(look())).json()["id"]
    (settings.data_dir / "observations" / seen / "features.npz").write_bytes(b"")
    assert client.get(f"/v1/observations/{seen}").status_code == 200
    for ending in ("?include=debug", "/pca.png"):
        unavailable(client.get(f"/v1/observations/{seen}{ending}"), "restore it from a backup")
        path = "/v1/observations/{observation_id}" + ending.partition("?")[0]
        assert "503" in client.get("/openapi.json").json()["paths"][path]["get"]["responses"]


def test_damaged_views_of_a_scan_make_no_category(client, settings, look, parts):
    scan = client.post("/v1/observations", files=parts(look())).json()["scan"]
    client.post(f"/v1/scans/{scan['id']}/views", files=parts(look()))
    for path in (settings.data_dir / "scans").rglob("cameras.json"):
        path.write_bytes(path.read_bytes()[:10])
    unavailable(client.post(f"/v1/scans/{scan['id']}/complete"), "cameras.json is damaged")
    assert client.get("/v1/categories").json()["categories"] == []


def test_a_round_of_tidying_up_that_fails_does_not_end_the_service(settings, ailing, disk, look, parts, monkeypatch):
    monkeypatch.setattr(application, "PRUNE_EVERY_S", 0.01)
    rounds = []
    prune = Memory.prune
    monkeypatch.setattr(Memory, "prune", lambda self: (rounds.append(1), prune(self))[1])
    with TestClient(create_app(settings, backbone=ailing)) as client:
        disk.fault = failing(errno.ENOSPC, "begin")
        before = len(rounds)
        while len(rounds) < before + 3:
            client.get("/healthz")
        disk.fault = lambda kind, path: None
        assert client.post("/v1/observations", files=parts(look())).status_code == 201
