"""Nobody waits for ever, and nobody is worked for who has gone: a deadline, clients that leave, bodies that come slowly."""

from __future__ import annotations

import socket
import threading
import time
from urllib.parse import urlsplit

import anyio
import httpx
import pytest
from fastapi.testclient import TestClient

from service.app import create_app
from service.cancelling import Cancellation, present, require_wanted
from service.refusals import Busy, CalledOff, ClientGone, TooLate
from service.work import WorkQueue
from tests.service.conftest import LONG_S, Gate, until

SOON_S = 0.1


def asks(done):
    """Work that asks whether it is wanted, until it is not."""
    try:
        for _ in range(2000):
            time.sleep(0.01)
            require_wanted()
    except CalledOff:
        done.append("called off")
        raise


def test_what_takes_too_long_is_refused_and_stops_where_it_asks():
    async def late():
        done, queue = [], WorkQueue(1, 1, SOON_S)
        with pytest.raises(TooLate, match="ONELOOK_DEADLINE_S.*nothing was changed"):
            await queue.run(lambda: asks(done))
        while queue.pending:
            await anyio.sleep(0.01)
        assert done == ["called off"]
        assert await queue.run(lambda: 3) == 3
        await queue.finished()

    anyio.run(late)


def test_what_waits_too_long_for_its_turn_is_never_begun_and_frees_its_place_at_once():
    async def late():
        begun, release, queue = [], threading.Event(), WorkQueue(1, 1, 1.0)
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(lambda: queue.run(release.wait, endless=True))
            await anyio.wait_all_tasks_blocked()
            with pytest.raises(Busy, match="no worker was free") as refused:
                await queue.run(lambda: begun.append(1))
            assert refused.value.retry_after_s >= 1
            assert (queue.waiting, queue.running) == (0, 1)
            release.set()
        await queue.finished()
        assert begun == []

    anyio.run(late)


def test_what_writes_already_is_done_and_answered_however_late():
    def writes():
        present.get().begin_writing()
        time.sleep(4 * SOON_S)
        require_wanted()
        return "done"

    async def late():
        queue = WorkQueue(1, 0, SOON_S)
        assert await queue.run(writes) == "done"
        await queue.finished()

    anyio.run(late)


def test_what_was_called_off_writes_nothing():
    cancellation = Cancellation()
    assert cancellation.call_off()
    with pytest.raises(CalledOff):
        cancellation.begin_writing()


def test_whoever_goes_away_frees_place_and_worker():
    async def gone():
        done, told = [], []
        queue = WorkQueue(1, 1, on_refusal=told.append)
        with pytest.raises(ClientGone):
            await queue.run(lambda: asks(done), gone=lambda: anyio.sleep(SOON_S))
        while queue.pending:
            await anyio.sleep(0.01)
        assert (done, told) == (["called off"], ["gone"])
        await queue.finished()

    anyio.run(gone)


def test_workers_that_never_come_back_are_told_of_and_not_waited_for():
    async def hang():
        release, queue = threading.Event(), WorkQueue(1, 1, SOON_S)
        assert queue.stuck_s() is None
        with pytest.raises(TooLate):
            await queue.run(lambda: release.wait(LONG_S))
        await anyio.sleep(SOON_S)
        assert queue.stuck_s() >= SOON_S
        await queue.finished()
        release.set()
        while queue.pending:
            await anyio.sleep(0.01)
        assert queue.stuck_s() is None

    anyio.run(hang)


def test_a_burst_over_its_deadline_is_answered_and_changes_nothing(settings, backbone, look, parts):
    gate = Gate(backbone)
    with TestClient(create_app(settings.model_copy(update={"deadline_s": 1.0, "workers": 1}), backbone=gate)) as client:
        late = client.post("/v1/observations", files=parts(look()), headers={"Idempotency-Key": "once"})
        assert (late.status_code, late.json()["type"]) == (503, "urn:onelook:problem:unavailable")
        assert "ONELOOK_DEADLINE_S" in late.json()["detail"]
        unready = client.get("/readyz")
        assert (unready.status_code, client.get("/healthz").status_code) == (503, 200)
        assert "given up" in unready.json()["detail"]
        gate.open.set()
        until(lambda: client.get("/readyz").status_code == 200)
        assert client.get("/v1/observations").json()["observations"] == []
        until(lambda: client.post("/v1/observations", files=parts(look()), headers={"Idempotency-Key": "once"}).status_code == 201)
        assert len(client.get("/v1/observations").json()["observations"]) == 1


def test_a_client_that_goes_away_before_its_turn_costs_nothing(settings, backbone, serving, look, parts):
    gate, burst = Gate(backbone), look(views=3)
    with serving(settings.model_copy(update={"workers": 1}), gate) as url, httpx.Client(base_url=url, timeout=LONG_S) as client:
        first = threading.Thread(target=lambda: client.post("/v1/observations", files=parts(burst)))
        first.start()
        gate.entered.wait(LONG_S)
        with pytest.raises(httpx.ReadTimeout):
            httpx.post(f"{url}/v1/observations", files=parts(look(views=5)), timeout=0.5)
        until(lambda: "onelook_work_waiting 0.0" in client.get("/metrics").text)
        gate.open.set()
        first.join()
        assert len(client.get("/v1/observations").json()["observations"]) == 1
    assert sum(gate.passes) == 2 * 3, "two passes of the first burst's views, and none of the other's"


def test_a_body_that_comes_too_slowly_is_answered(settings, backbone, serving):
    with serving(settings.model_copy(update={"deadline_s": 0.3}), backbone) as url:
        where = urlsplit(url)
        with socket.create_connection((where.hostname, where.port), timeout=LONG_S) as connection:
            head = "POST /v1/observations HTTP/1.1\r\nHost: x\r\nContent-Type: application/x-npz\r\nContent-Length: 1000\r\n\r\n"
            connection.sendall(head.encode() + b"PK")
            answer = b"".join(iter(lambda: connection.recv(10_000), b"")).decode()
    assert answer.startswith("HTTP/1.1 503")
    assert "did not arrive within 0.3 s" in answer


def test_bodies_together_are_bounded(settings, backbone, serving):
    """Two places of 8 MB: a third body does not fit beside two that are on their way."""
    with serving(settings.model_copy(update={"workers": 1, "queue": 1}), backbone) as url:
        where = urlsplit(url)
        head = b"POST /v1/observations HTTP/1.1\r\nHost: x\r\nContent-Type: application/x-npz\r\nContent-Length: 7900000\r\n\r\n"
        slow = [socket.create_connection((where.hostname, where.port), timeout=LONG_S) for _ in range(2)]
        for connection in slow:
            connection.sendall(head + bytes(7_800_000))
        body, kind = bytes(7_000_000), {"content-type": "application/x-npz"}

        def refused():
            answer = httpx.post(f"{url}/v1/observations", content=body, headers=kind, timeout=LONG_S)
            return answer.status_code == 503 and "MB together" in answer.json()["detail"] and answer.headers["retry-after"]

        until(refused)
        for connection in slow:
            connection.close()
        until(lambda: httpx.post(f"{url}/v1/observations", content=body, headers=kind, timeout=LONG_S).status_code == 422)


def test_a_text_body_is_bounded_far_below_an_upload(client):
    body = b'{"name": "' + b"x" * 5_000_000 + b'"}'
    for path in ("/v1/categories/x/merge", "/v1/scans", "/v1/memory/calibrate"):
        answer = client.post(path, content=body, headers={"content-type": "application/json"})
        assert (answer.status_code, "more than 4 MB" in answer.json()["detail"]) == (413, True)
