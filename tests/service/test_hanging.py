"""What hangs for ever ends its process, to be started anew by whoever supervises it; what is merely slow does not."""

from __future__ import annotations

import json
import os
import threading
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import anyio
import httpx
import numpy as np
import pytest
from fastapi import FastAPI

from core.errors import Unavailable
from service.batching import BatchingBackbone
from service.cancelling import present
from service.server import WRITE_DEADLINES, Server
from service.work import WorkQueue
from tests.service.conftest import LONG_S, Gate, until
from tests.service.test_stopping import Process, served

DEADLINE_S = 1.5
SHORT_S = 0.15
"""Of a service that is not asked for anything that takes long."""


def asked_until_it_ends(service: Process, ask: Any) -> dict[str, Any]:
    """The last line of the log of a service that ends itself while it is asked."""
    end = time.monotonic() + LONG_S
    while service.child.poll() is None:
        assert time.monotonic() < end, "it never ended"
        try:
            ask()
        except httpx.TransportError:  # it ended, and so answered nobody
            service.child.wait(LONG_S)
    assert service.child.returncode == os.EX_SOFTWARE == 70
    last: dict[str, Any] = json.loads(service.child.stderr.read().splitlines()[-1])
    assert last["level"] == "ERROR"
    assert "to be started anew" in last["message"]
    return last


def test_a_backbone_that_hangs_ends_the_process_and_one_that_was_slow_does_not(tmp_path: Path, look: Any, parts: Any) -> None:
    files, sign = parts(look()), tmp_path / "pass-hangs"
    with served(tmp_path / "memory", 0, workers=2, deadline_s=DEADLINE_S) as service:
        until(lambda: service.http.post("/v1/observations", files=files).status_code == 201)
        seen = service.http.get("/v1/observations").json()["observations"]
        sign.touch()
        assert service.http.post("/v1/observations", files=files).status_code == 503
        sign.unlink()  # within the second deadline
        service.until("onelook_work_running", 0.0)
        sign.touch()
        asked = time.monotonic()
        last = asked_until_it_ends(service, lambda: service.http.post("/v1/observations", files=files))
        assert time.monotonic() - asked >= 2 * DEADLINE_S, "what was slow before does not count"
        assert "a pass of the backbone has run for" in last["message"]
    sign.unlink()
    with served(tmp_path / "memory", 0) as again:
        assert again.http.get("/v1/observations").json()["observations"] == seen, "what was answered, and nothing else"
        assert again.http.post("/v1/observations", files=files).status_code == 201


def test_a_disk_that_hangs_ends_the_process(tmp_path: Path, look: Any, parts: Any) -> None:
    files = parts(look(views=1))
    with served(tmp_path / "memory", 0, deadline_s=SHORT_S) as service:
        (tmp_path / "disk-hangs").touch()
        began = time.monotonic()

        last = asked_until_it_ends(service, lambda: service.http.post("/v1/observations", files=files, headers={"Idempotency-Key": "once"}))
        assert "the event loop has stood still" in last["message"]
        assert time.monotonic() - began >= WRITE_DEADLINES * SHORT_S


@pytest.mark.parametrize(
    ("found", "said"),
    [
        ({"pass_s": 2.1}, "a pass of the backbone"),
        ({"pass_s": 1.9}, None),
        ({"pass_s": 2.1, "writing": True}, None),
        ({"stuck_s": 1.1}, "all workers"),
        ({"stuck_s": 0.9}, None),
        ({"late_write_s": WRITE_DEADLINES + 0.1}, "a write"),
        ({"late_write_s": WRITE_DEADLINES - 0.1, "writing": True}, None),
    ],
)
def test_what_hangs_had_a_second_deadline_and_what_may_be_a_slow_disk_ten(found: dict[str, Any], said: str | None) -> None:
    figures = {"pass_s": 0.0, "stuck_s": None, "late_write_s": 0.0, "writing": False} | found
    app = FastAPI()
    app.state.running = SimpleNamespace(
        settings=SimpleNamespace(deadline_s=1.0),
        agent=SimpleNamespace(backbone=SimpleNamespace(pass_s=lambda: figures["pass_s"])),
        work=SimpleNamespace(stuck_s=lambda: figures["stuck_s"], late_write_s=lambda: figures["late_write_s"], writing=figures["writing"]),
    )
    hanging = Server(app).hanging()
    assert hanging is None if said is None else said in (hanging or "")


def test_a_pass_that_takes_longer_than_a_request_may_is_not_sound(backbone: Any) -> None:
    gate = Gate(backbone)
    batching = BatchingBackbone(gate, deadline_s=SHORT_S)
    thread = threading.Thread(target=batching.extract, args=(np.zeros((1, 16, 16, 3), np.uint8),))
    thread.start()
    gate.entered.wait(LONG_S)
    until(lambda: batching.pass_s() > SHORT_S)
    with pytest.raises(Unavailable, match="a pass of the backbone colour has run"):
        batching.require_sound()
    gate.open.set()
    thread.join()
    assert batching.pass_s() == 0
    batching.require_sound()


def test_a_write_is_late_after_its_deadline_and_what_has_none_never_is() -> None:
    async def write() -> None:
        release, queue = threading.Event(), WorkQueue(2, 0, SHORT_S)

        def writes() -> None:
            present.get().begin_writing()
            release.wait(LONG_S)

        async with anyio.create_task_group() as tasks:
            tasks.start_soon(lambda: queue.run(writes, endless=True))
            while not queue.writing:
                await anyio.sleep(0.01)
            await anyio.sleep(2 * SHORT_S)
            assert (queue.late_write_s(), queue.stuck_s()) == (0, None)
            tasks.start_soon(queue.run, writes)
            while queue.late_write_s() <= SHORT_S:
                await anyio.sleep(0.01)
            assert (queue.writing, queue.stuck_s()) == (True, None), "the endless one; and both will be answered"
            release.set()
        assert (queue.writing, queue.late_write_s()) == (False, 0)
        await queue.finished()

    anyio.run(write)
