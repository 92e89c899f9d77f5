"""Tracking: one camera at its own rate, whatever the service manages; what is answered, how late, and what is dropped.

One object teaches the category, the recorded views of another one are the frames, there and back again: the camera turns by far more from
frame to frame than one at 15 Hz does, which is the harder case. Frames are sent by the clock and never wait for answers.
"""

from __future__ import annotations

import asyncio
import itertools
import json as json_
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from websockets.asyncio.client import ClientConnection, connect

from benchmarks.load import teach
from benchmarks.pairs import two_of_a_kind
from benchmarks.parallel import bar
from benchmarks.tables import report
from clients.datasets import folders
from clients.datasets.samples import data_or_samples
from clients.datasets.sources import find_sequences
from clients.errors import problem_from_json
from clients.exchange import connection_to
from clients.tracking import MAX_MESSAGE_BYTES, Conversation, websocket_url
from core.views import View

PATCH_PX = 14
"""Side of a patch of the embedded backbone, with which the services run."""
WARM_UP = 6
"""Frames that are answered one by one before the clock starts: the window fills, and kernels load."""
LATE_S = 10.0
"""After the last frame was sent, how long its answer is waited for."""
Serve = Callable[[Path, int, bool], AbstractContextManager[str]]
"""serve(memory, grid, warm): the address of a service whose close crop has so many patches a side, and that starts from the last pose or
solves each frame anew."""


@dataclass(frozen=True)
class TrackRow:
    """One service."""

    side_px: int
    """Of the close crop."""
    warm: bool
    sent: int
    per_s: float
    """Frames answered a second."""
    p50_ms: float
    p95_ms: float
    p99_ms: float
    """From sending a frame to its answer; of the answered ones."""
    dropped: int
    posed: float
    """Share of answers with a pose that the frame itself gave."""


@dataclass
class Stream:
    """What became of the frames."""

    sent_s: dict[int, float] = field(default_factory=dict)
    answered_s: dict[int, float] = field(default_factory=dict)
    measured: list[bool] = field(default_factory=list)
    dropped: int = 0

    def read(self, text: str | bytes, now_s: float) -> None:
        """One message of the service. Raises the ServiceProblem that it tells of."""
        message = json_.loads(text)
        if message["type"] == "problem":
            raise problem_from_json(message["problem"]["status"], message["problem"])
        if message["type"] == "dropped":
            self.dropped += message["frames"]
        elif message["type"] == "pose":
            self.answered_s[message["frame_id"]] = now_s
            self.measured.append(bool(message["measured"]))

    @property
    def over(self) -> bool:
        """Whether every frame was answered or dropped."""
        return len(self.answered_s) + self.dropped >= len(self.sent_s)

    def row(self, side_px: int, warm: bool) -> TrackRow:
        """In one line; the rate is over the time from the first frame to the last answer."""
        if not self.answered_s:
            return TrackRow(side_px, warm, len(self.sent_s), 0.0, np.nan, np.nan, np.nan, self.dropped, np.nan)
        late_ms = [1000 * (at - self.sent_s[each]) for each, at in self.answered_s.items()]
        p50, p95, p99 = np.percentile(late_ms, (50, 95, 99)).tolist()
        took_s = max(self.answered_s.values()) - min(self.sent_s.values())
        return TrackRow(side_px, warm, len(self.sent_s), len(late_ms) / took_s, p50, p95, p99, self.dropped, float(np.mean(self.measured)))


def run(serve: Serve, json: Path | None, *, grids: Sequence[int], rate_hz: float, seconds: float, data: Path | None) -> list[TrackRow]:
    """A row for each side of the close crop, with and without the last pose; prints a table.

    `serve` starts a service of the benchmark's own: this package knows none. Raises InvalidInput where no category has two objects.
    """
    taught, followed = two_of_a_kind(find_sequences(data_or_samples(data)), views=1)
    frames = folders.load_burst(followed).views
    rows = []
    with bar() as progress:
        for grid, warm in progress.track(list(itertools.product(grids, (True, False))), description="tracking"):
            with TemporaryDirectory() as folder, serve(Path(folder) / "memory", grid, warm) as url:
                category_id = teach(url, taught)
                stream = asyncio.run(_follow(url, category_id, frames, rate_hz, seconds))
            rows.append(stream.row(grid * PATCH_PX, warm))
    meta = {"benchmark": "track", "rate_hz": rate_hz, "seconds": seconds}
    report(f"Tracking, a camera at {rate_hz:.0f} Hz, {seconds:.0f} s each", rows, meta, json)
    return rows


async def _follow(url: str, category_id: str, frames: Sequence[View], rate_hz: float, seconds: float) -> Stream:
    with connection_to(url):
        async with connect(websocket_url(url), max_size=MAX_MESSAGE_BYTES) as socket:
            return await _stream(socket, category_id, frames, rate_hz, seconds)


async def _stream(socket: ClientConnection, category_id: str, frames: Sequence[View], rate_hz: float, seconds: float) -> Stream:
    turns = itertools.cycle([*frames, *frames[-2:0:-1]])
    talk, stream = Conversation(), Stream()
    await socket.send(talk.hello(category_id=category_id))
    for number, view in zip(range(WARM_UP), turns):
        await socket.send(talk.frame(view, number / rate_hz))
        while talk.read(await socket.recv()) is None:
            pass
    times = range(WARM_UP, WARM_UP + round(rate_hz * seconds))
    messages = [(number, talk.frame(view, number / rate_hz)) for number, view in zip(times, turns)]
    listening = asyncio.create_task(_listen(socket, stream))
    await _send(socket, messages, rate_hz, stream)
    end = time.monotonic() + LATE_S
    while not (stream.over or listening.done()) and time.monotonic() < end:
        await asyncio.sleep(0.05)
    if listening.done():
        listening.result()  # raises what it was told of
    listening.cancel()
    return stream


async def _send(socket: ClientConnection, messages: Sequence[tuple[int, str]], rate_hz: float, stream: Stream) -> None:
    started = time.monotonic()
    for place, (number, message) in enumerate(messages):
        await asyncio.sleep(max(0.0, started + place / rate_hz - time.monotonic()))
        stream.sent_s[number] = time.monotonic()
        await socket.send(message)


async def _listen(socket: ClientConnection, stream: Stream) -> None:
    async for text in socket:
        stream.read(text, time.monotonic())
