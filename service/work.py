"""Where work that fills the machine runs: off the event loop, a few pieces at once, with a bounded queue before it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Literal, TypeVar

import anyio
from anyio.to_thread import run_sync

from core.errors import Unavailable

T = TypeVar("T")
FIRST_GUESS_S = 2.0
"""Of a piece of work, before one was timed."""
MEMORY = 0.8
"""Weight of earlier times in the estimate of the next."""
RESTART_S = 10
"""After which a request that a stopping service refused is worth sending again."""
POLL_S = 0.02
Refusal = Literal["full", "stopping"]


class Busy(Unavailable):
    """The queue is full, or the service stops."""

    def __init__(self, message: str, retry_after_s: int) -> None:
        super().__init__(message)
        self.retry_after_s = retry_after_s


class WorkQueue:
    """Runs pieces of work in threads; who comes when it is full is sent away at once."""

    def __init__(
        self,
        workers: int,
        queue: int,
        on_start: Callable[[float], None] = lambda waited_s: None,
        on_refusal: Callable[[Refusal], None] = lambda why: None,
    ) -> None:
        """`workers` pieces run at once, `queue` more may wait; the callbacks are told what becomes of each."""
        self._places = anyio.CapacityLimiter(workers)
        self._threads = anyio.CapacityLimiter(workers)
        self._workers = workers
        self._queue = queue
        self._on_start = on_start
        self._on_refusal = on_refusal
        self._piece_s = FIRST_GUESS_S
        self._stopping = False
        self.pending = 0
        """Pieces that run or wait."""
        self.running = 0

    @property
    def waiting(self) -> int:
        """Pieces that wait."""
        return self.pending - self.running

    async def run(self, work: Callable[[], T]) -> T:
        """The result of `work()`. Raises Busy."""
        self._require_open()
        if self.pending >= self._workers + self._queue:
            self._on_refusal("full")
            wait_s = max(1, math.ceil(self._piece_s * self.pending / self._workers))
            raise Busy(f"{self.pending} requests are being worked on or wait (ONELOOK_QUEUE); send it again in {wait_s} s", wait_s)
        self.pending += 1
        arrived = time.perf_counter()
        try:
            async with self._places:
                self._require_open()
                self._on_start(time.perf_counter() - arrived)
                self.running += 1
                try:
                    return await run_sync(self._timed, work, limiter=self._threads)
                finally:
                    self.running -= 1
        finally:
            self.pending -= 1

    def stop(self) -> None:
        """From now on nothing new is begun, neither of what comes nor of what waits."""
        self._stopping = True

    async def finished(self) -> None:
        """Returns once nothing runs any more."""
        while self.running:
            await anyio.sleep(POLL_S)

    def _require_open(self) -> None:
        if self._stopping:
            self._on_refusal("stopping")
            raise Busy(f"the service is stopping; send it again in {RESTART_S} s, when it may have started anew", RESTART_S)

    def _timed(self, work: Callable[[], T]) -> T:
        start = time.perf_counter()
        try:
            return work()
        finally:
            self._piece_s = MEMORY * self._piece_s + (1 - MEMORY) * (time.perf_counter() - start)
