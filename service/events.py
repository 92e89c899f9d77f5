"""What happened, told to whoever listens: a short history, and a bounded queue for each listener."""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from collections.abc import AsyncIterator, Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from store.times import now

Kind = Literal[
    "observation",
    "observation_corrected",
    "scan_begun",
    "scan_views",
    "scan_changed",
    "scan_deleted",
    "category_created",
    "category_renamed",
    "category_merged",
    "category_split",
    "category_deleted",
    "instance_forgotten",
    "goal_created",
    "goal_deleted",
    "memory_calibrated",
    "memory_imported",
    "change_undone",
    "dropped",
]
HISTORY = 256
"""Events kept for a listener that comes back."""
BACKLOG = 64
"""Events that wait for a slow listener; then the oldest are dropped, and it is told how many."""


@dataclass(frozen=True)
class Event:
    """One thing that happened."""

    id: int
    """Grows by one with each event of this process."""
    kind: Kind
    created_at: str
    """ISO 8601, UTC."""
    about: Mapping[str, Any]
    """Ids and names, as JSON has them."""


class _Listener:
    def __init__(self) -> None:
        self.loop = asyncio.get_running_loop()
        self.waiting: deque[Event] = deque()
        self.dropped = 0
        self.arrived = asyncio.Event()


class Events:
    """Safe to publish to from every thread."""

    def __init__(self, on_event: Callable[[Event], None] = lambda event: None) -> None:
        """`on_event` is told of each event, in the thread that publishes it."""
        self._on_event = on_event
        self._lock = threading.Lock()
        self._history: deque[Event] = deque(maxlen=HISTORY)
        self._listeners: set[_Listener] = set()
        self._next = 1
        self._closed = False

    @property
    def last_id(self) -> int:
        """Of the latest event, 0 before the first."""
        with self._lock:
            return self._next - 1

    def publish(self, kind: Kind, **about: Any) -> None:
        """Tells every listener; never waits for one."""
        with self._lock:
            event = Event(self._next, kind, now(), about)
            self._next += 1
            self._history.append(event)
            for listener in self._listeners:
                if len(listener.waiting) >= BACKLOG:
                    listener.waiting.popleft()
                    listener.dropped += 1
                listener.waiting.append(event)
                listener.loop.call_soon_threadsafe(listener.arrived.set)
        self._on_event(event)

    def close(self) -> None:
        """Ends every listening: the service stops."""
        with self._lock:
            self._closed = True
            for listener in self._listeners:
                listener.loop.call_soon_threadsafe(listener.arrived.set)

    async def listen(self, after: int | None = None) -> AsyncIterator[Event]:
        """Events as they happen; with `after`, first those of the history with a larger id.

        An event `dropped` says how many were left out, because they came faster than they were taken or are older than the history.
        """
        listener = _Listener()
        with self._lock:
            if after is not None and after < self._next:
                oldest = self._history[0].id if self._history else self._next
                listener.dropped = max(0, oldest - after - 1)
                listener.waiting.extend(event for event in self._history if event.id > after)
            self._listeners.add(listener)
        try:
            while not self._closed:
                with self._lock:
                    waiting, dropped = list(listener.waiting), listener.dropped
                    listener.waiting.clear()
                    listener.dropped = 0
                    listener.arrived.clear()
                if dropped:
                    first = waiting[0]
                    yield Event(first.id - 1, "dropped", first.created_at, {"events": dropped})
                for event in waiting:
                    yield event
                if not waiting:
                    await listener.arrived.wait()
        finally:
            with self._lock:
                self._listeners.discard(listener)
