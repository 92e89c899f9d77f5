"""Why the service does not do what it is asked, beside the errors of the method and the memory (core/errors.py).

OneLookError
├── NoKey           nobody knows who asks
├── NotAllowed      it is known who asks, and they may not
├── TooOften        the key's requests of this minute are used up
├── CalledOff       nobody waits for this piece of work any more
└── Unavailable
    ├── Busy        the queue is full or too slow, or the service stops
    ├── TooLate     it took longer than it may
    └── ClientGone  nobody is there to be answered
"""

from __future__ import annotations

from core.errors import OneLookError, Unavailable


class NoKey(OneLookError):
    """Nobody knows who asks."""


class NotAllowed(OneLookError):
    """It is known who asks, and they may not."""


class TooOften(OneLookError):
    """The key's requests of this minute are used up."""

    def __init__(self, message: str, retry_after_s: int) -> None:
        super().__init__(message)
        self.retry_after_s = retry_after_s


class CalledOff(OneLookError):
    """Nobody waits for this piece of work any more."""


class Busy(Unavailable):
    """The queue is full or too slow, or the service stops."""

    def __init__(self, message: str, retry_after_s: int) -> None:
        super().__init__(message)
        self.retry_after_s = retry_after_s


class TooLate(Unavailable):
    """A request took longer than it may."""


class ClientGone(Unavailable):
    """Nobody is there to be answered."""
