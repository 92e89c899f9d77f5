"""One request, and how its answer is read."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import httpx

from clients.multipart import burst_npz, burst_parts
from core.errors import InvalidInput
from core.views import Burst

T = TypeVar("T")
Body = Mapping[str, Any]
"""As httpx takes it: `json`, `files`, or `content` with its `headers`."""
Direction = Sequence[float]
"""Three numbers in a burst's world frame."""


@dataclass(frozen=True, eq=False)
class Call(Generic[T]):
    """One request."""

    method: str
    path: str
    read: Callable[[httpx.Response], T]
    """What the answer means."""
    params: Mapping[str, Any] = field(default_factory=dict)
    body: Body = field(default_factory=dict)


def given(**options: Any) -> dict[str, Any]:
    """Query options without those that are None, which the service decides."""
    return {name: value for name, value in options.items() if value is not None}


def burst_body(burst: Burst, frame: str | None = None, exact: bool = False) -> Body:
    """A burst as a body. Raises InvalidInput where only some views have depth, a mask or a camera."""
    if not exact:
        return {"files": burst_parts(burst, frame)}
    if frame is not None:
        raise InvalidInput("frame", f"an npz body has no place for one, found {frame!r}; leave out exact or frame")
    return {"content": burst_npz(burst), "headers": {"Content-Type": "application/x-npz"}}


def burst_or_id(source: Burst | str, frame: str | None = None) -> Body:
    """A burst, or the id of an earlier observation, as a body."""
    return {"json": {"observation_id": source}} if isinstance(source, str) else burst_body(source, frame)


def reading(make: Callable[[Mapping[str, Any]], T]) -> Callable[[httpx.Response], T]:
    """Reads one JSON object."""
    return lambda response: make(response.json())


def reading_list(name: str, make: Callable[[Mapping[str, Any]], T]) -> Callable[[httpx.Response], list[T]]:
    """Reads the JSON objects of a list that is called `name`."""
    return lambda response: [make(fields) for fields in response.json()[name]]


def nothing(response: httpx.Response) -> None:
    """Of an answer without a body."""
