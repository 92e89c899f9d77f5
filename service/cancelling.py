"""Whether a piece of work is still wanted: a robot may go away, or have waited too long.

A thread cannot be stopped from outside, so work asks by itself: before a pass of the backbone, before a pose, and before it writes.
Once it writes, it goes on to its end: what was answered as not done is not done later, and what is done is answered.
"""

from __future__ import annotations

import threading
from contextvars import ContextVar

from service.refusals import CalledOff


class Cancellation:
    """One piece of work. Safe to use from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._called_off = False
        self._writing = False

    def call_off(self) -> bool:
        """From now on it is not wanted; False where it writes already, and so will be done."""
        with self._lock:
            self._called_off = not self._writing
            return self._called_off

    @property
    def writing(self) -> bool:
        """Whether it cannot be called off any more."""
        return self._writing

    def require(self) -> None:
        """Raises CalledOff."""
        with self._lock:
            self._require()

    def begin_writing(self) -> None:
        """From now on it cannot be called off. Raises CalledOff."""
        with self._lock:
            self._require()
            self._writing = True

    def _require(self) -> None:
        if self._called_off:
            raise CalledOff("nobody waits for this any more")


present: ContextVar[Cancellation | None] = ContextVar("cancellation", default=None)
"""Of the piece of work that runs here; None outside of the queue."""


def require_wanted() -> None:
    """Raises CalledOff where nobody waits for the present piece of work any more."""
    cancellation = present.get()
    if cancellation is not None:
        cancellation.require()
