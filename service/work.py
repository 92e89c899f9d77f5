"""Where work that fills the machine runs: off the event loop, a few pieces at once, with a bounded queue before it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import TypeVar

import anyio
from anyio.to_thread import run_sync

from core.errors import Unavailable

T = TypeVar("T")
FIRST_GUESS_S = 2.0
"""Of a piece of work, before one was timed."""
MEMORY = 0.8
"""Weight of earlier times in the estimate of the next."""


class Busy(Unavailable):
    """The queue is full."""

    def __init__(self, message: str, retry_after_s: int) -> None:
        super().__init__(message)
        self.retry_after_s = retry_after_s


class WorkQueue:
    """Runs pieces of work in threads; who comes when it is full is sent away at once."""

    def __init__(self, workers: int, queue: int) -> None:
        """`workers` pieces run at once, `queue` more may wait."""
        self._limiter = anyio.CapacityLimiter(workers)
        self._workers = workers
        self._queue = queue
        self._piece_s = FIRST_GUESS_S
        self.pending = 0
        """Pieces that run or wait."""

    async def run(self, work: Callable[[], T]) -> T:
        """The result of `work()`. Raises Busy."""
        if self.pending >= self._workers + self._queue:
            wait_s = max(1, math.ceil(self._piece_s * self.pending / self._workers))
            raise Busy(f"{self.pending} requests are being worked on or wait (ONELOOK_QUEUE); send it again in {wait_s} s", wait_s)
        self.pending += 1
        try:
            return await run_sync(self._timed, work, limiter=self._limiter)
        finally:
            self.pending -= 1

    def _timed(self, work: Callable[[], T]) -> T:
        start = time.perf_counter()
        try:
            return work()
        finally:
            self._piece_s = MEMORY * self._piece_s + (1 - MEMORY) * (time.perf_counter() - start)
