"""The application around the routes: start, probes, OpenAPI, and errors that nobody expected."""

from __future__ import annotations

import importlib.metadata
import math
from dataclasses import fields

import pytest
from fastapi.testclient import TestClient
from pydantic import ValidationError

import service.app
from core.calibration import Prior
from core.errors import Conflict, InvalidInput, OneLookError, Unavailable
from service.agent import Agent, AgentConfig
from service.app import create_app
from service.errors import KINDS, problem_of
from service.refusals import CalledOff, TooOften
from service.settings import Settings
from store.retention import Retention
from tests.service.conftest import until


def test_probes_say_that_it_is_well(client):
    assert client.get("/healthz").json() == client.get("/readyz").json() == {"status": "ok"}


def test_info_tells_the_backbone_and_the_memory(client, learn):
    before = client.get("/v1/info").json()
    assert before["version"] == importlib.metadata.version("onelook")
    assert (before["backbone"], before["fingerprint"], before["categories"]) == ("colour", "colour-1", 0)
    learn()
    after = client.get("/v1/info").json()
    assert after["categories"] == 1
    assert after["memory_version"] > before["memory_version"]


def test_a_memory_of_another_backbone_is_refused_at_the_start(settings, backbone):
    with TestClient(create_app(settings, backbone=backbone)):
        pass

    class Other(type(backbone)):
        name, fingerprint = "other", "other-1"

    with pytest.raises(Conflict, match=r"colour-1.*other-1"), TestClient(create_app(settings, backbone=Other())):
        pass


def test_figures_of_another_backbone_are_told_at_the_start(settings, backbone, caplog):
    class Measured(type(backbone)):
        fingerprint = Prior.shipped().fingerprint

    for network, told in ((backbone, True), (Measured(), False)):
        caplog.clear()
        own = settings.model_copy(update={"score": "best", "data_dir": settings.data_dir / network.fingerprint})
        with TestClient(create_app(own, backbone=network)):
            assert ("figures of another backbone" in caplog.text) == told


def test_an_unknown_score_is_refused_at_the_start(settings, backbone):
    wrong = settings.model_copy(update={"score": "nonsense"})
    with pytest.raises(InvalidInput, match="'nonsense' is none of"), TestClient(create_app(wrong, backbone=backbone)):
        pass


def test_settings_come_from_the_environment(monkeypatch):
    monkeypatch.setenv("ONELOOK_PORT", "8123")
    monkeypatch.setenv("ONELOOK_DATA_DIR", "/somewhere")
    settings = Settings()
    assert (settings.port, str(settings.data_dir)) == (8123, "/somewhere")


@pytest.mark.parametrize("name", ["undo_days", "scan_expiry_h", "session_h"])
def test_a_span_beyond_the_calendar_is_refused_by_its_name(name):
    for span in (1e8, math.inf):
        with pytest.raises(ValidationError, match=f"{name}\n.*less than or equal"):
            Settings(**{name: span})


def test_backups_are_beside_the_memory_however_its_folder_is_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for written in (".", str(tmp_path), "below/..", f"../{tmp_path.name}"):
        assert Settings(data_dir=written).backups == tmp_path.with_name(f"{tmp_path.name}-backups")


def test_two_applications_live_side_by_side(settings, backbone, tmp_path, look, parts):
    other = settings.model_copy(update={"data_dir": tmp_path / "other"})
    with TestClient(create_app(settings, backbone=backbone)) as first, TestClient(create_app(other, backbone=backbone)) as second:
        first.post("/v1/observations", files=parts(look()))
        assert len(first.get("/v1/observations").json()["observations"]) == 1
        assert second.get("/v1/observations").json()["observations"] == []


def test_nothing_there_is_a_problem(client):
    answer = client.get("/v1/nothing")
    assert (answer.status_code, answer.headers["content-type"]) == (404, "application/problem+json")
    assert "/docs" in answer.json()["detail"]


def test_a_method_that_is_not_answered_is_a_problem(client):
    answer = client.put("/v1/info")
    assert (answer.status_code, answer.json()["title"]) == (405, "Method Not Allowed")
    assert answer.headers["allow"] == "GET"


def test_the_unexpected_is_a_problem_without_a_trace(settings, backbone, look, parts, monkeypatch):
    def broken(*args, **options):
        raise RuntimeError("secret detail")

    monkeypatch.setattr(Agent, "observe", broken)
    with TestClient(create_app(settings, backbone=backbone), raise_server_exceptions=False) as client:
        answer = client.post("/v1/observations", files=parts(look()))
    assert (answer.status_code, answer.headers["content-type"]) == (500, "application/problem+json")
    assert "secret" not in answer.text
    assert "Traceback" not in answer.text


def test_settings_left_out_are_the_defaults_of_the_agent_and_the_memory():
    settings = Settings()
    assert AgentConfig(**{each.name: getattr(settings, each.name) for each in fields(AgentConfig)}) == AgentConfig()
    assert settings.retention == Retention()


def test_every_kind_of_error_has_a_problem():
    kinds = {kind for kind, *_ in KINDS}

    def leaves(kind):
        below = kind.__subclasses__()
        return {kind} | {leaf for each in below for leaf in leaves(each)}

    own = {kind for kind in leaves(OneLookError) if kind.__module__ in {"core.errors", "service.refusals"}}
    busy = leaves(Unavailable) - {Unavailable}  # answered alike
    assert own - busy - {OneLookError, CalledOff} == kinds  # nobody is there to be told of work that was called off


def test_the_most_particular_kind_wins():
    for kind, status, name, _ in KINDS:
        arguments = ("field", "message") if issubclass(kind, InvalidInput) else ("message", 1) if kind is TooOften else ("message",)
        error = kind(*arguments)
        assert (problem_of(error).status, problem_of(error).type) == (status, f"urn:onelook:problem:{name}")


def test_openapi_refers_only_to_what_it_has(client):
    document = client.get("/openapi.json").json()
    schemas = document["components"]["schemas"]

    def references(node):
        if isinstance(node, dict):
            yield from [node["$ref"]] if isinstance(node.get("$ref"), str) else []
            for each in node.values():
                yield from references(each)
        elif isinstance(node, list):
            for each in node:
                yield from references(each)

    assert {reference.removeprefix("#/components/schemas/") for reference in references(document)} <= set(schemas)
    assert "HTTPValidationError" not in schemas


def test_operation_ids_are_the_routes_names(client):
    document = client.get("/openapi.json").json()
    ids = {operation["operationId"] for path in document["paths"].values() for operation in path.values()}
    assert {"observe", "begin_scan", "complete_scan", "list_categories", "info"} <= ids


def test_what_every_exchange_has_in_common_is_in_the_schema(client):
    paths = client.get("/openapi.json").json()["paths"]
    read, write = paths["/v1/categories/{category_id}"]["get"], paths["/v1/observations"]["post"]
    assert "If-None-Match" in [parameter["name"] for parameter in read["parameters"]]
    assert "304" in read["responses"]
    assert "Idempotency-Key" in [parameter["name"] for parameter in write["parameters"]]
    assert {"409", "413", "415", "422", "503"} <= set(write["responses"])


def test_every_documented_error_is_a_problem(client):
    paths = client.get("/openapi.json").json()["paths"]
    for path, methods in paths.items():
        for method, operation in methods.items():
            for status, response in operation["responses"].items():
                if status >= "400":
                    assert list(response["content"]) == ["application/problem+json"], (method, path, status)


def test_a_body_that_is_no_text_is_a_problem(client):
    answer = client.post("/v1/memory/calibrate", content=b"\xff\xfe{", headers={"content-type": "application/json"})
    assert (answer.status_code, answer.json()["field"]) == (422, "body")


def test_what_has_an_end_is_ended_while_the_service_runs(settings, backbone, look, parts, monkeypatch):
    monkeypatch.setattr(service.app, "PRUNE_EVERY_S", 0.02)
    with TestClient(create_app(settings.model_copy(update={"scan_expiry_h": 1e-6}), backbone=backbone)) as client:
        client.post("/v1/scans", files=parts(look()))
        rows = client.app.state.running.agent.memory._connection.rows
        until(lambda: rows("SELECT state FROM scans") == [{"state": "expired"}])
