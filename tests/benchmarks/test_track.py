"""The tracking bench: what becomes of each frame, from the messages of a service."""

from __future__ import annotations

import asyncio
import json
import shutil
from collections.abc import Awaitable, Callable
from pathlib import Path

import numpy as np
import pytest
from websockets.asyncio.server import ServerConnection, serve

from benchmarks import track
from benchmarks.track import Stream
from clients.datasets.folders import find_sequences, load_burst
from clients.errors import PROBLEM_URN, UnavailableProblem, Unreachable
from core.errors import InvalidInput


def pose(frame: int, measured: bool = True) -> str:
    return json.dumps({"type": "pose", "frame_id": frame, "measured": measured})


WELCOME = json.dumps({"type": "welcome"})


def answered(frame: int) -> str:
    """An answer without a pose, with all that a client reads."""
    nothing = dict.fromkeys(("category_id", "pose", "data_age_s", "reason", "outcome"))
    return json.dumps({"type": "pose", "frame_id": frame, "measured": False, "views": 1, "latency_ms": 1.0, **nothing})


def test_rate_latency_and_what_was_dropped() -> None:
    stream = Stream(sent_s={0: 0.0, 1: 0.1, 2: 0.2, 3: 0.3})
    stream.read(pose(0), 0.5)
    stream.read(json.dumps({"type": "found", "frame_id": 0}), 0.5)
    assert not stream.over
    stream.read(json.dumps({"type": "dropped", "frames": 2, "first_id": 1, "last_id": 2}), 0.6)
    stream.read(pose(3, measured=False), 1.0)
    assert stream.over
    row = stream.row(224, warm=True)
    assert (row.sent, row.dropped, row.per_s, row.posed) == (4, 2, 2.0, 0.5)
    assert row.p50_ms == pytest.approx((500 + 700) / 2)
    assert row.p99_ms == pytest.approx(700, abs=5)


def test_a_service_that_answers_nothing_has_a_row_too() -> None:
    row = Stream(sent_s={0: 0.0, 1: 0.1}).row(224, warm=True)
    assert (row.sent, row.per_s, row.dropped) == (2, 0.0, 0)
    assert np.isnan([row.p50_ms, row.posed]).all()


def follow(recorded: Path, then: Callable[[ServerConnection], Awaitable[None]]) -> Stream:
    """What becomes of frames where the service answers while it warms up, and `then` does this."""

    async def answer(socket: ServerConnection) -> None:
        for number in range(track.WARM_UP + 1):  # the greeting and the first frames
            message = json.loads(await socket.recv())
            await socket.send(WELCOME if number == 0 else answered(message["id"]))
        await socket.recv()
        await then(socket)

    async def stream() -> Stream:
        async with serve(answer, "127.0.0.1", 0, max_size=None) as server:
            port = server.sockets[0].getsockname()[1]
            frames = load_burst(find_sequences(recorded)[0]).views
            return await track._follow(f"http://127.0.0.1:{port}", "c", frames, 50, 0.2)

    return asyncio.run(stream())


def test_a_problem_is_no_late_answer(recorded: Path) -> None:
    problem = {"type": f"{PROBLEM_URN}unavailable", "status": 503, "title": "Busy", "detail": "all lanes are taken"}

    async def tell(socket: ServerConnection) -> None:
        await socket.send(json.dumps({"type": "problem", "problem": problem}))
        await socket.wait_closed()

    with pytest.raises(UnavailableProblem, match="all lanes are taken"):
        follow(recorded, tell)


def test_a_service_that_goes_down_is_unreachable(recorded: Path) -> None:
    async def die(socket: ServerConnection) -> None:
        socket.transport.abort()

    with pytest.raises(Unreachable, match="no connection to http://127.0.0.1"):
        follow(recorded, die)


def test_a_kind_of_one_object_has_nothing_to_follow(recorded: Path) -> None:
    shutil.rmtree(recorded / "egg" / "small")
    with pytest.raises(InvalidInput, match="no category has two objects"):
        track.run(lambda memory, grid, warm: pytest.fail("nothing is to be served"), None, grids=[16], rate_hz=15, seconds=1, data=recorded)
