"""Where work that fills the machine runs: off the event loop, a few pieces at once, with a bounded queue before it and a deadline."""

from __future__ import annotations

import asyncio
import math
import threading
import time
from collections.abc import Callable, Coroutine
from concurrent.futures import Future, ThreadPoolExecutor
from contextvars import Context, copy_context
from typing import Any, Literal, TypeVar

from core.errors import Unavailable
from service.cancelling import Cancellation, present
from service.refusals import Busy, ClientGone, TooLate
from store.connection import before_change

T = TypeVar("T")
FIRST_GUESS_S = 2.0
"""Of a piece of work, before one was timed."""
MEMORY = 0.8
"""Weight of earlier times in the estimate of the next."""
RESTART_S = 10
"""After which a request that a stopping service refused is worth sending again."""
POLL_S = 0.02
Refusal = Literal["full", "stopping", "late", "gone"]
Gone = Callable[[], Coroutine[Any, Any, None]]
"""Returns once whoever asked has gone away."""


class WorkQueue:
    """Runs pieces of work in threads; who comes when it is full is sent away at once."""

    def __init__(
        self,
        workers: int,
        queue: int,
        deadline_s: float = math.inf,
        on_start: Callable[[float], None] = lambda waited_s: None,
        on_refusal: Callable[[Refusal], None] = lambda why: None,
    ) -> None:
        """`workers` pieces run at once, `queue` more may wait; the callbacks are told what becomes of each."""
        self._threads = ThreadPoolExecutor(workers, "work")
        self._workers = workers
        self._queue = queue
        self._deadline_s = deadline_s
        self._on_start = on_start
        self._on_refusal = on_refusal
        self._piece_s = FIRST_GUESS_S
        self._stopping = False
        self._lock = threading.Lock()
        self._pending = 0
        self._running: set[Cancellation] = set()
        self._given_up: dict[Cancellation, float] = {}
        """Pieces that still run though nobody waits for them, and since when."""
        self._late_writes: dict[Cancellation, float] = {}
        """Pieces that would have been given up if they did not write already, and since when."""

    @property
    def pending(self) -> int:
        """Pieces that run or wait."""
        return self._pending

    @property
    def running(self) -> int:
        """Pieces that run."""
        return len(self._running)

    @property
    def waiting(self) -> int:
        """Pieces that wait: those beyond what the workers take at once."""
        return max(self._pending - self._workers, 0)

    @property
    def writing(self) -> bool:
        """Whether something writes that is not late, or may take as long as it takes."""
        with self._lock:
            return any(cancellation.writing for cancellation in self._running - self._late_writes.keys())

    async def run(self, work: Callable[[], T], *, gone: Gone | None = None, endless: bool = False) -> T:
        """The result of `work()`; what is `endless` is waited for however long it takes, also for nobody.

        Raises Busy, TooLate after the queue's deadline, and ClientGone once `gone` returns. What was not begun by then is dropped; what
        runs learns of it where it asks (service/cancelling.py), and keeps its worker until then. What already writes is finished and
        answered, however late.
        """
        self._require_place()
        cancellation = Cancellation()
        if endless:
            cancellation.begin_writing()
        with self._lock:
            self._pending += 1
        future: Future[T] = self._threads.submit(self._piece, cancellation, work, copy_context(), time.perf_counter())
        future.add_done_callback(lambda _: self._leave())
        answer = asyncio.wrap_future(future)
        answer.add_done_callback(lambda done: done.cancelled() or done.exception())  # looked at, since nobody else may
        try:
            why = None if endless else await self._awaited(answer, gone)
        except asyncio.CancelledError:
            self._give_up(cancellation, future)
            raise
        if why is not None and self._give_up(cancellation, future):
            self._on_refusal("gone" if isinstance(why, ClientGone) else "late")
            never_begun = future.cancelled() and isinstance(why, TooLate)
            raise self._busy(f"no worker was free for {self._deadline_s:g} s") if never_begun else why
        return await answer

    async def _awaited(self, answer: asyncio.Future[T], gone: Gone | None) -> Unavailable | None:
        """None once there is an answer; else why it is not waited for any longer."""
        leaving = asyncio.ensure_future(gone()) if gone is not None else None
        awaited: set[asyncio.Future[Any]] = {answer} if leaving is None else {answer, leaving}
        deadline_s = None if math.isinf(self._deadline_s) else self._deadline_s
        try:
            done, _ = await asyncio.wait(awaited, timeout=deadline_s, return_when=asyncio.FIRST_COMPLETED)
        finally:
            if leaving is not None:
                leaving.cancel()
        if answer in done:
            return None
        if leaving in done:
            return ClientGone("whoever asked has gone away")
        return TooLate(
            f"it was not done within {self._deadline_s:g} s (ONELOOK_DEADLINE_S), and nothing was changed; send fewer or smaller views"
        )

    def _give_up(self, cancellation: Cancellation, future: Future[Any]) -> bool:
        """Whether it could be: not where it writes already."""
        dropped = cancellation.call_off()
        if not (dropped and future.cancel()):
            with self._lock:
                if cancellation in self._running:
                    (self._given_up if dropped else self._late_writes)[cancellation] = time.monotonic()
        return dropped

    def stop(self) -> None:
        """From now on nothing new is begun, neither of what comes nor of what waits."""
        self._stopping = True

    async def finished(self) -> None:
        """Returns once nothing runs any more."""
        while len(self._running) > len(self._given_up):  # those never write
            await asyncio.sleep(POLL_S)
        self._threads.shutdown(wait=False, cancel_futures=True)

    def stuck_s(self) -> float | None:
        """For how long all workers have been held by work that nobody waits for any more; None where one is not."""
        with self._lock:
            return time.monotonic() - max(self._given_up.values()) if len(self._given_up) >= self._workers else None

    def late_write_s(self) -> float:
        """For how long the longest write has gone on after its deadline; 0 where none does. What is `endless` is never late."""
        with self._lock:
            return time.monotonic() - min(self._late_writes.values()) if self._late_writes else 0.0

    def _require_place(self) -> None:
        self._require_open()
        if self._pending >= self._workers + self._queue:
            self._on_refusal("full")
            raise self._busy(f"{self._pending} requests are being worked on or wait (ONELOOK_QUEUE)")

    def _busy(self, why: str) -> Busy:
        wait_s = max(1, math.ceil(self._piece_s * self._pending / self._workers))
        return Busy(f"{why}; send it again in {wait_s} s", wait_s)

    def _require_open(self) -> None:
        if self._stopping:
            self._on_refusal("stopping")
            raise Busy(f"the service is stopping; send it again in {RESTART_S} s, when it may have started anew", RESTART_S)

    def _piece(self, cancellation: Cancellation, work: Callable[[], T], context: Context, arrived: float) -> T:
        """In a thread of the pool."""
        self._require_open()
        start = time.perf_counter()
        with self._lock:
            self._running.add(cancellation)
        try:
            cancellation.require()
            self._on_start(start - arrived)
            return context.run(_cancellable, cancellation, work)
        except Exception:
            raise
        except BaseException as error:  # of a library that ends what it takes for its own process; this one goes on
            raise Unavailable(f"the worker was ended ({error!r}); the next request gets another one") from error
        finally:
            with self._lock:
                self._running.discard(cancellation)
                self._given_up.pop(cancellation, None)
                self._late_writes.pop(cancellation, None)
            self._piece_s = MEMORY * self._piece_s + (1 - MEMORY) * (time.perf_counter() - start)

    def _leave(self) -> None:
        with self._lock:
            self._pending -= 1


def _cancellable(cancellation: Cancellation, work: Callable[[], T]) -> T:
    present.set(cancellation)
    before_change.set(cancellation.begin_writing)
    return work()
