"""The log tells of every request whose it was and what became of it."""

from __future__ import annotations

import io
import json
import logging
import logging.config

import pytest
from fastapi.testclient import TestClient

from service.agent import Agent
from service.app import create_app
from service.logs import config, request_id


@pytest.fixture
def written(request, monkeypatch):
    """written(form): the log's text from then on, in that form."""
    loggers = [logging.getLogger(name) for name in ("onelook", "uvicorn")]
    before = [(logger, logger.handlers[:], logger.level, logger.propagate) for logger in loggers]

    def begin(form="json"):
        stream = io.StringIO()
        monkeypatch.setattr("sys.stderr", stream)
        logging.config.dictConfig(config(form))
        return stream

    yield begin
    for logger, handlers, level, propagate in before:
        logger.handlers[:] = handlers
        logger.setLevel(level)
        logger.propagate = propagate


def lines(stream):
    return [json.loads(line) for line in stream.getvalue().splitlines()]


def test_an_observation_is_told_with_its_request_and_its_robot(client, look, parts, written):
    log = written()
    sent = {"X-Request-Id": "arm-2:17", "X-Actor": "arm 2"}
    answer = client.post("/v1/observations", files=parts(look()), headers=sent)
    decided, answered = lines(log)
    assert answer.headers["x-request-id"] == "arm-2:17"
    assert (decided["message"], decided["outcome"], decided["id"]) == ("observation", "novel", answer.json()["id"])
    assert (answered["message"], answered["method"], answered["path"]) == ("request", "POST", "/v1/observations")
    assert answered["status"] == 201
    assert answered["seconds"] > 0
    for line in (decided, answered):
        assert (line["level"], line["request_id"], line["robot"]) == ("INFO", "arm-2:17", "arm 2")


def test_the_robot_is_the_key_before_what_it_says(settings, backbone, written):
    with TestClient(create_app(settings, backbone=backbone)) as client:
        key = client.app.state.running.agent.memory.keys.create("arm", "robot")[1]
        log = written()
        client.get("/v1/info", headers={"Authorization": f"Bearer {key}", "X-Actor": "left"})
        client.get("/v1/info")
    allowed, refused = [line for line in lines(log) if line["message"] == "request"]
    assert (allowed["status"], allowed["robot"]) == (200, "arm (left)")
    assert refused["status"] == 401
    assert "robot" not in refused
    assert key not in log.getvalue()


@pytest.mark.parametrize("given", ["", "two words", "x" * 65, "é"])
def test_an_id_that_is_none_is_replaced(client, given):
    answered = client.get("/v1/info", headers={"X-Request-Id": given.encode()}).headers["x-request-id"]
    assert answered != given
    assert len(answered) == 32


def test_requests_get_ids_of_their_own(client):
    assert len({client.get("/v1/info").headers["x-request-id"] for _ in range(3)}) == 3
    assert request_id.get() is None


def test_probes_are_left_out_while_they_are_well(client, written):
    log = written()
    for path in ("/healthz", "/readyz", "/metrics"):
        client.get(path)
    assert log.getvalue() == ""


def test_text_is_a_line_that_nobody_else_can_end(client, written):
    log = written("text")
    client.get("/v1/categories/x%0AINFO%20forged", headers={"X-Actor": "a\tb=c"})
    (line,) = log.getvalue().splitlines()
    assert " INFO request method=GET path=" in line
    assert 'robot="a\\tb=c"' in line
    assert "\\n" in line


def test_a_failure_is_told_with_its_traceback_and_its_request(written):
    log = written()
    request_id.set("r1")
    try:
        raise RuntimeError("broken disk")
    except RuntimeError:
        logging.getLogger("uvicorn.error").exception("Exception in ASGI application")
    finally:
        request_id.set(None)
    (line,) = lines(log)
    assert (line["level"], line["logger"], line["request_id"]) == ("ERROR", "uvicorn.error", "r1")
    assert "broken disk" in line["exception"]


def test_what_nobody_expected_is_answered_with_the_id_to_look_for(settings, backbone, look, parts, monkeypatch):
    def broken(*args, **options):
        raise RuntimeError("out of order")

    monkeypatch.setattr(Agent, "observe", broken)
    with TestClient(create_app(settings, backbone=backbone), raise_server_exceptions=False) as client:
        answer = client.post("/v1/observations", files=parts(look()), headers={"X-Request-Id": "r2"})
    assert (answer.status_code, answer.headers["x-request-id"]) == (500, "r2")


def test_what_the_service_lacks_is_a_warning(client, look, parts, written, monkeypatch):
    from core.errors import Unavailable

    def full(*args, **options):
        raise Unavailable("the disk is full")

    monkeypatch.setattr(client.app.state.running.agent.memory.observations, "create", full)
    log = written()
    assert client.post("/v1/observations", files=parts(look())).status_code == 503
    warned = lines(log)[0]
    assert (warned["level"], warned["message"]) == ("WARNING", "the disk is full")
    assert warned["request_id"] == lines(log)[1]["request_id"]
