"""The root of every error OneLook raises on purpose, and the branches of the method and the memory.

The service (service/refusals.py) and its client (clients/errors.py) have branches of their own.

OneLookError
├── InvalidInput        a field of the caller's input is wrong; names the field
│   ├── TooFewViews     more views are needed than were given
│   └── NoObject        nothing in the views could be told from the background
├── NoPose              the input is fine, but no transform explains it
├── NotFound            no such category, scan or observation
├── Conflict            the thing is in a state that does not allow this
│   └── StillRunning    (store/requests.py) the first request with a key is not answered yet
└── Unavailable         weights, disk or queue cannot serve this now
"""

from __future__ import annotations


class OneLookError(Exception):
    """Root of the tree; `str(error)` is one sentence that a person can act on."""


class InvalidInput(OneLookError):
    """A field of the input is wrong.

    `field` is the path a caller would use (`views[3].depth`), `message` says what was found and what was expected.
    """

    def __init__(self, field: str, message: str) -> None:
        super().__init__(f"{field}: {message}")
        self.field = field
        self.message = message

    def __reduce__(self) -> tuple[type[InvalidInput], tuple[str, str]]:
        """Made anew from its parts in another process."""
        return type(self), (self.field, self.message)


class TooFewViews(InvalidInput):
    """More views are needed than were given."""


class NoObject(InvalidInput):
    """Nothing in the views could be told from the background."""


class NoPose(OneLookError):
    """No transform explains enough of the correspondences; never answered by an identity instead."""


class NotFound(OneLookError):
    """No category, scan or observation has this id."""


class Conflict(OneLookError):
    """The resource is in a state that does not allow what was asked."""


class Unavailable(OneLookError):
    """Something the service depends on is missing or busy; the message names the remedy."""
