"""The demo episode: one at a time, in an empty memory, with a key of its own, and never longer than the service."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from fastapi.testclient import TestClient

from core.errors import Conflict
from service.app import create_app
from service.console import demo
from service.console.demo import Demo
from tests.service.conftest import until, with_keys


@pytest.fixture
def begun(monkeypatch):
    """What was started in the place of the simulator: (arguments, environment); each would run for a minute."""
    started = []
    popen = subprocess.Popen

    def stand_in(arguments, **options):
        started.append((arguments, options["env"]))
        return popen([sys.executable, "-c", "import time; time.sleep(60)"], **options)

    monkeypatch.setattr(demo.subprocess, "Popen", stand_in)
    return started


@pytest.fixture
def episode():
    """One that ends with the test."""
    made = Demo()
    yield made
    made.close()


def test_a_robot_is_pointed_at_this_service(client, begun, episode):
    memory = client.app.state.running.agent.memory
    episode.start(memory, "http://127.0.0.1:8000")
    ((arguments, environment),) = begun
    assert arguments[3] == "simulate"
    assert arguments[arguments.index("--url") + 1] == "http://127.0.0.1:8000"
    assert "ONELOOK_API_KEY" not in environment
    assert episode.state() == demo.DemoState(True, 0, None, True)


def test_one_at_a_time(client, begun, episode):
    memory = client.app.state.running.agent.memory
    episode.start(memory, "http://x")
    with pytest.raises(Conflict, match="runs already"):
        episode.start(memory, "http://x")
    episode.stop()
    episode.start(memory, "http://x")
    assert len(begun) == 2


def test_nothing_is_taught_among_what_was_learnt(client, begun, episode, ball):
    with pytest.raises(Conflict, match="the memory is not empty"):
        episode.start(client.app.state.running.agent.memory, "http://x")
    assert begun == []
    assert "It needs an empty memory" in client.get("/try").text


def test_it_ends_with_the_service(settings, backbone, begun):
    app = create_app(settings, backbone=backbone)
    with TestClient(app) as service:
        assert "Stop it" in service.post("/try/demo").text
        process = app.state.running.demo._process
        assert process.poll() is None
    assert process.poll() is not None


def test_it_ends_after_a_while(client, begun, episode, monkeypatch):
    monkeypatch.setattr(demo, "LIMIT_S", 0.05)
    episode.start(client.app.state.running.agent.memory, "http://x")
    until(lambda: not episode.state().running)
    assert episode.state().failure == "it was stopped"


def test_why_it_failed_is_told(client, monkeypatch, episode):
    popen = subprocess.Popen
    failing = [sys.executable, "-c", "print('error: no world'); raise SystemExit(1)"]
    monkeypatch.setattr(demo.subprocess, "Popen", lambda arguments, **options: popen(failing, **options))
    episode.start(client.app.state.running.agent.memory, "http://x")
    episode._process.wait()
    assert episode.state() == demo.DemoState(False, 0, "error: no world", True)


def test_progress_is_read_from_what_it_writes(client, begun, episode):
    episode.start(client.app.state.running.agent.memory, "http://x")
    with open(os.path.join(episode._folder.name, "episode.jsonl"), "w") as lines:
        lines.write('{"settings": 1}\n{"number": 1}\n{"number": 2}\n{"numb')
    assert episode.state().met == 2


def test_where_keys_are_set_the_robot_has_one(client, begun, episode):
    memory = client.app.state.running.agent.memory
    memory.keys.create("anna", "admin")
    for _ in range(2):
        episode.start(memory, "http://x", actor="anna")
        episode.stop()
    first, second = (environment["ONELOOK_API_KEY"] for _, environment in begun)
    assert memory.keys.find(first) is None, "the earlier episode's is revoked"
    assert memory.keys.find(second).role == "robot"


def test_only_an_admin_begins_one_and_only_a_robot_asks(client, begun):
    sent = with_keys(client.app.state.running.agent.memory.keys)
    for role, shown in (("viewer", False), ("robot", True)):
        assert client.post("/try/demo", headers=sent[role]).status_code == 403
        assert ("Ask what it is" in client.get("/try", headers=sent[role]).text) is shown
    assert begun == []
    assert client.post("/try/demo", headers=sent["admin"]).status_code == 200
