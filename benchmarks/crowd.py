"""Robots that work at once against one service on this machine, and what the service says of itself meanwhile."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Literal, get_args
from urllib.parse import urlsplit

import numpy as np

from clients.asynchronous import AsyncRobotClient
from clients.errors import ClientError, ServiceProblem
from clients.exchange import Retry
from clients.metrics import metrics
from core.errors import InvalidInput

ONCE = Retry(attempts=1)
"""Refusals are to be counted, not hidden."""
LOOPBACK = frozenset({"127.0.0.1", "localhost", "::1"})
BUSY = frozenset({429, 503})
PAUSE_S = 1.0
"""Of a refused robot that is not told how long to wait."""
MEGABYTE = 1e6

Errand = Callable[[AsyncRobotClient, np.random.Generator], Awaitable[None]]
"""One piece of a robot's work: one request, or a few that belong together."""
Fate = Literal["answered", "refused", "failed"]
FATES: tuple[Fate, ...] = get_args(Fate)


@dataclass(frozen=True)
class Attempt:
    """One errand, and what came of it."""

    ended_s: float
    """Since the crowd began."""
    seconds: float
    fate: Fate
    why: str | None = None
    """It was not answered."""


@dataclass(frozen=True)
class Sample:
    """The service at one moment."""

    time_s: float
    """Since the crowd began."""
    resident_mb: float
    running: float
    waiting: float
    cpu_s: float = 0.0
    """Processor time of the service's process since it began."""


@dataclass
class Record:
    """What a crowd lived through."""

    attempts: list[Attempt] = field(default_factory=list)
    samples: list[Sample] = field(default_factory=list)

    def of(self, fate: Fate) -> list[Attempt]:
        """The attempts that ended so."""
        return [attempt for attempt in self.attempts if attempt.fate == fate]


def require_loopback(url: str) -> None:
    """Raises InvalidInput for an address of another machine: load is for one's own service only."""
    host = urlsplit(url).hostname
    if host not in LOOPBACK:
        raise InvalidInput("--url", f"is {url}; load is put only on a service of this machine, at one of {', '.join(sorted(LOOPBACK))}")


async def crowd(
    url: str, robots: int, seconds: float, errand: Errand, *, seed: int = 0, sample_s: float = 0.5, tell: Callable[[Record], None]
) -> Record:
    """Lets so many robots do errands one after the other for so long; each ends the errand that it is at.

    A refused robot waits as long as it is told to. `tell` hears of every sample.
    """
    record, start = Record(), time.perf_counter()
    end = start + seconds
    over = asyncio.Event()
    watching = asyncio.create_task(_watch(url, record, start, sample_s, over, tell))
    generators = np.random.default_rng(seed).spawn(robots)
    await asyncio.gather(*(_robot(url, errand, each, record, start, end) for each in generators))
    over.set()
    await watching
    return record


async def _robot(url: str, errand: Errand, rng: np.random.Generator, record: Record, start: float, end: float) -> None:
    async with AsyncRobotClient(url, retry=ONCE) as robot:
        while (began := time.perf_counter()) < end:
            fate: Fate = "answered"
            why, pause_s = None, 0.0
            try:
                await errand(robot, rng)
            except ServiceProblem as problem:
                refused = problem.status in BUSY
                fate, why = "refused" if refused else "failed", f"{problem.status} {problem}"
                pause_s = (problem.retry_after_s or PAUSE_S) if refused else 0.0
            except ClientError as error:
                fate, why, pause_s = "failed", str(error), PAUSE_S
            now = time.perf_counter()
            record.attempts.append(Attempt(now - start, now - began, fate, why))
            await asyncio.sleep(max(0.0, min(pause_s, end - now)))


async def _watch(url: str, record: Record, start: float, every_s: float, over: asyncio.Event, tell: Callable[[Record], None]) -> None:
    async with AsyncRobotClient(url) as observer:
        while not over.is_set():
            found = await observer.send(metrics())
            resident_mb = found["process_resident_memory_bytes"] / MEGABYTE
            now = time.perf_counter() - start
            queue = found["onelook_work_running"], found["onelook_work_waiting"]
            record.samples.append(Sample(now, resident_mb, *queue, found["process_cpu_seconds_total"]))
            tell(record)
            try:
                await asyncio.wait_for(over.wait(), every_s)
            except asyncio.TimeoutError:
                continue
