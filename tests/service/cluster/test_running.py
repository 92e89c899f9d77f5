"""The application on Ray Serve answers as it does in one process."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any

import grpc
import numpy as np
import pytest
from fastapi.testclient import TestClient

from core.errors import Unavailable
from core.sim3 import Sim3
from core.views import Burst, View
from service.app import create_app
from tests.service.conftest import LONG_S, Gate

TIMES = {"created_at", "expires_at", "timings_ms"}
"""What no two runs have in common."""
SHORT_S = 0.1
LOOPBACK = {"0100007F", "0000000000000000FFFF00000100007F", "00000000000000000000000001000000"}
"""As the kernel writes it."""


def test_an_encoder_whose_pass_hangs_asks_to_be_replaced(settings: Any, backbone: Any, look: Any, monkeypatch: Any) -> None:
    monkeypatch.setattr("logging.config.dictConfig", lambda config: None)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Ray's own
        from service.cluster.replicas import EncoderReplica
    gate = Gate(backbone)
    encoder = EncoderReplica(settings.model_copy(update={"deadline_s": SHORT_S}), gate)
    with ThreadPoolExecutor(1) as threads:
        asked = threads.submit(encoder.encode, look())
        try:
            gate.entered.wait(LONG_S)
            time.sleep(2 * SHORT_S)
            with pytest.raises(Unavailable, match="longer than a request may take"):
                encoder.check_health()
        finally:
            gate.open.set()
        asked.result()
    encoder.check_health()


@pytest.fixture
def alone(settings: Any, backbone: Any) -> Iterator[TestClient]:
    """The same service in this process."""
    with TestClient(create_app(settings.model_copy(update={"score": "best"}), backbone=backbone)) as client:
        yield client


def comparable(answer: Any, names: dict[str, str], number: Callable[[float], Any] = float) -> Any:
    """An answer without times, its ids called by the order in which they first came."""
    if isinstance(answer, dict):
        return {key: comparable(value, names, number) for key, value in answer.items() if key not in TIMES}
    if isinstance(answer, list):
        return [comparable(each, names, number) for each in answer]
    if isinstance(answer, float):
        return number(answer)
    if isinstance(answer, str):
        for word in answer.replace("'", " ").replace("/", " ").split():
            if len(word) == 32 and set(word) <= set("0123456789abcdef"):
                answer = answer.replace(word, names.setdefault(word, f"id-{len(names)}"))
    return answer


def life(http: Any, look: Callable[..., Burst], parts: Callable[..., Any]) -> list[Any]:
    """What a robot and a person ask, and what they are answered."""
    answers: list[Any] = []

    def ask(method: str, path: str, **request: Any) -> Any:
        response = http.request(method, path, **request)
        body = response.json() if response.content and "json" in response.headers["content-type"] else len(response.content) > 0
        answers.append([method, response.status_code, body])
        return body

    for kind, name in (("bright", "lamp"), ("dark", None)):
        ask("POST", "/v1/observations", files=parts(look(kind)))
        scan = ask("POST", "/v1/scans", files=parts(look(kind)))
        ask("POST", f"/v1/scans/{scan['id']}/views", files=parts(look(kind)))
        ask("POST", f"/v1/scans/{scan['id']}/complete", json={"name": name})
    turned = Sim3(1.0, np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.array([0.1, 0.2, 0.0]))
    there = parts(look("bright", views=5, world_from_object=turned))
    ask("POST", "/v1/observations", files=there)
    seen = ask("POST", "/v1/observations?false_known_rate=0.4", files=there)
    ask("POST", "/v1/observations?variant=best&learn=false&include=debug", files=parts(look("dark", views=4)))
    ask("GET", f"/v1/observations/{seen['id']}/overlay.png")
    category_id = seen["similarities"][0]["category_id"]
    goal = ask("POST", f"/v1/categories/{category_id}/goals", json={"observation_id": seen["id"]})
    ask("POST", f"/v1/goals/{goal['id']}/plan", files=parts(look("bright", views=4)))
    ask("DELETE", f"/v1/categories/{category_id}")
    ask("POST", "/v1/observations?learn=false", files=parts(look("bright", views=5)))
    ask("POST", f"/v1/observations?category_id={category_id}", files=parts(look("bright", views=5)))
    ask("POST", "/v1/observations", files=parts(Burst([View(np.zeros_like(each.rgb), each.depth_m, each.camera) for each in look().views])))
    ask("GET", "/v1/categories")
    ask("GET", "/v1/info")
    return answers


def test_it_answers_as_one_process_does(cluster: Any, alone: TestClient, look: Any, parts: Any) -> None:
    told, expected = life(cluster.http, look, parts), life(alone, look, parts)
    assert comparable(told, {}) == comparable(expected, {}, lambda value: pytest.approx(value, rel=1e-6, abs=1e-9))
    outcomes = [body["outcome"] for _, status, body in told if status == 201 and isinstance(body, dict) and "outcome" in body]
    assert {"known", "novel"} <= set(outcomes)


def test_all_that_are_asked_at_once_answer_from_what_was_learnt_last(cluster: Any, look: Any, parts: Any) -> None:
    """Two encoders and two solvers take part, and none of them knows less than the others."""
    for name in ("first", "second"):
        scan = cluster.http.post("/v1/scans", files=parts(look("bright"))).json()
        assert cluster.http.post(f"/v1/scans/{scan['id']}/views", files=parts(look("bright"))).status_code == 200
        made = cluster.http.post(f"/v1/scans/{scan['id']}/complete", json={"name": name}).json()
        version = cluster.http.get("/v1/info").json()["memory_version"]
        before = {part: cluster.processes(part) for part in ("Encoder", "PoseSolver")}
        body = parts(look("bright", views=4))
        with ThreadPoolExecutor(8) as robots:
            asked = f"/v1/observations?learn=false&category_id={made['id']}"
            answers = list(robots.map(lambda _, asked=asked, body=body: cluster.http.post(asked, files=body), range(8)))
        assert [answer.status_code for answer in answers] == [201] * 8
        assert len({str(answer.json()["pose"]["target_from_reference"]) for answer in answers}) == 1
        assert {answer.json()["name"] for answer in answers} == {name}
        assert cluster.http.get("/v1/info").json()["memory_version"] == version + 8
        for part, earlier in before.items():
            now = cluster.processes(part)
            assert len(earlier) == 2
            assert all(now[pid] > seconds for pid, seconds in earlier.items()), f"an idle {part}: {earlier}, {now}"
        assert cluster.http.delete(f"/v1/categories/{made['id']}").status_code == 204


def test_it_listens_on_this_machine_and_asks_elsewhere_for_a_token(cluster: Any) -> None:
    replicas = [pid for part in ("Encoder", "PoseSolver", "MemoryOwner") for pid in cluster.processes(part)]
    everywhere = {port for pid in replicas for address, port in listening(pid) if address not in LOOPBACK}
    assert len(everywhere) == len(replicas)  # the one port that Ray Serve gives each
    for port in everywhere:
        with grpc.insecure_channel(f"127.0.0.1:{port}") as channel, pytest.raises(grpc.RpcError) as refused:
            channel.unary_unary("/ray.serve.ASGIService/HandleRequest")(b"", timeout=30)
        assert refused.value.code() == grpc.StatusCode.UNAUTHENTICATED
    telemetry = [b"RAY_USAGE_STATS_ENABLED=0" in Path(f"/proc/{pid}/environ").read_bytes().split(b"\0") for pid in replicas]
    assert telemetry == [True] * 5


def listening(pid: int) -> set[tuple[str, int]]:
    """Addresses, in the kernel's hexadecimal, and ports that a process listens on."""
    sockets = set()
    for descriptor in Path(f"/proc/{pid}/fd").iterdir():
        with suppress(OSError):
            sockets.add(os.readlink(descriptor).removeprefix("socket:[").removesuffix("]"))
    lines = [line.split() for name in ("tcp", "tcp6") for line in Path(f"/proc/{pid}/net/{name}").read_text().splitlines()[1:]]
    found = [line[1].rsplit(":", 1) for line in lines if line[3] == "0A" and line[9] in sockets]
    return {(address, int(port, 16)) for address, port in found}
