"""What can go wrong between a client and the service.

OneLookError
└── ClientError             root of this tree; `str(error)` is one sentence that a person can act on
    ├── Unreachable         nothing answers at the address
    ├── TooSlow             the answer did not come in time
    └── ServiceProblem      the service answered with a problem (RFC 9457): `.status`, `.title`, `.field`, `.retry_after_s`
        ├── InvalidInputProblem
        │   ├── TooFewViewsProblem
        │   └── NoObjectProblem
        ├── NoPoseProblem
        ├── NotFoundProblem
        ├── ConflictProblem
        ├── UnavailableProblem
        ├── NoKeyProblem
        ├── NotAllowedProblem
        ├── TooOftenProblem
        └── UnexpectedProblem
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from core.errors import OneLookError

PROBLEM_URN = "urn:onelook:problem:"


class ClientError(OneLookError):
    """Root of the tree."""


class Unreachable(ClientError):
    """Nothing answers at the service's address."""


class TooSlow(ClientError):
    """The answer did not come within the client's time limit."""


class ServiceProblem(ClientError):
    """The service answered that something is wrong; `str(problem)` is its detail."""

    def __init__(self, detail: str, *, status: int, title: str = "", field: str | None = None, retry_after_s: float | None = None) -> None:
        super().__init__(detail)
        self.status = status
        self.title = title
        self.field = field
        """Path of the wrong field (`views[3].depth`), where it is one field's fault."""
        self.retry_after_s = retry_after_s
        """Seconds after which the service expects to be able, where it says so."""


class InvalidInputProblem(ServiceProblem):
    """A field of the request is wrong."""


class TooFewViewsProblem(InvalidInputProblem):
    """More views are needed than were sent."""


class NoObjectProblem(InvalidInputProblem):
    """Nothing in the views stands out from the background."""


class NoPoseProblem(ServiceProblem):
    """No transform explains the views."""


class NotFoundProblem(ServiceProblem):
    """There is no such category, scan or observation."""


class ConflictProblem(ServiceProblem):
    """The thing is in a state that does not allow this."""


class UnavailableProblem(ServiceProblem):
    """Something the service needs is missing or busy."""


class NoKeyProblem(ServiceProblem):
    """The service asks for a key, and got none that is valid: give `api_key`, or set ONELOOK_API_KEY."""


class NotAllowedProblem(ServiceProblem):
    """The key's role does not allow this."""


class TooOftenProblem(ServiceProblem):
    """The key's requests are used up for now; `retry_after_s` says for how long."""


class UnexpectedProblem(ServiceProblem):
    """The service failed in a way it did not expect; its log says where."""


PROBLEMS: Mapping[str, type[ServiceProblem]] = {
    f"{PROBLEM_URN}{name}": kind
    for name, kind in {
        "invalid-input": InvalidInputProblem,
        "too-few-views": TooFewViewsProblem,
        "no-object": NoObjectProblem,
        "no-pose": NoPoseProblem,
        "not-found": NotFoundProblem,
        "conflict": ConflictProblem,
        "unavailable": UnavailableProblem,
        "no-key": NoKeyProblem,
        "not-allowed": NotAllowedProblem,
        "too-often": TooOftenProblem,
        "unexpected": UnexpectedProblem,
    }.items()
}


def problem_from_json(status: int, problem: Mapping[str, Any], retry_after_s: float | None = None) -> ServiceProblem:
    """The exception for a problem's JSON; an unknown type is a plain ServiceProblem."""
    kind = PROBLEMS.get(problem.get("type", ""), ServiceProblem)
    title = problem.get("title", "")
    return kind(problem.get("detail") or title, status=status, title=title, field=problem.get("field"), retry_after_s=retry_after_s)
