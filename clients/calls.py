"""What can be asked of the service: each function makes one request, and knows how to read its answer.

Nothing here sends: `RobotClient` and `AsyncRobotClient` do, each in its way. So both have the same methods, with the same arguments.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import httpx

from clients.answers import Category, Info, Observation, ScanRequest
from clients.multipart import burst_npz, burst_parts
from core.errors import InvalidInput
from core.views import Burst

T = TypeVar("T")
U = TypeVar("U")
Body = Mapping[str, Any]
"""As httpx takes it: `json`, `files`, or `content` with its `headers`."""


@dataclass(frozen=True, eq=False)
class Call(Generic[T]):
    """One request."""

    method: str
    path: str
    read: Callable[[httpx.Response], T]
    """What the answer means."""
    params: Mapping[str, Any] = field(default_factory=dict)
    body: Body = field(default_factory=dict)

    def then(self, wrap: Callable[[T], U]) -> Call[U]:
        """The same request, whose answer is `wrap` of this one's."""
        return Call(self.method, self.path, lambda response: wrap(self.read(response)), self.params, self.body)


def observe(
    burst: Burst,
    *,
    frame: str | None = None,
    learn: bool = True,
    category_id: str | None = None,
    threshold: float | None = None,
    views_used: int | None = None,
    variant: str | None = None,
    seed: int | None = None,
    debug: bool = False,
    exact: bool = False,
) -> Call[Observation[ScanRequest]]:
    """What `burst` shows: a known object with its pose, or a novel one with a scan to carry out.

    Args:
        frame: name of the burst's world frame, given back as it came.
        learn: whether a known object's burst joins its category.
        category_id: takes the object for one of this category, and skips the decision.
        threshold: least similarity of a known object.
        views_used: only the first so many views.
        variant, seed: of the pose pipeline; the same seed gives the same pose.
        debug: adds to `raw` what the pose was computed from.
        exact: sends every pixel as it is, in one npz file many times larger, instead of colour as JPEG and depth in millimetres.
    """
    options = {"category_id": category_id, "threshold": threshold, "views_used": views_used, "variant": variant, "seed": seed}
    params = {name: value for name, value in options.items() if value is not None} | {"learn": learn}
    if debug:
        params["include"] = "debug"
    return Call("POST", "/v1/observations", _read(Observation.from_json), params, _burst_body(burst, frame, exact))


def observation(observation_id: str, *, debug: bool = False) -> Call[Observation[ScanRequest]]:
    """An earlier observation, as it was answered then."""
    params = {"include": "debug"} if debug else {}
    return Call("GET", f"/v1/observations/{observation_id}", _read(Observation.from_json), params)


def observations(limit: int = 50) -> Call[list[Observation[ScanRequest]]]:
    """The latest observations, newest first."""
    return Call("GET", "/v1/observations", _read_list("observations", Observation.from_json), {"limit": limit})


def scan(source: Burst | str) -> Call[ScanRequest]:
    """A scan of the object of a burst, or of an earlier observation by its id, whatever was decided then."""
    body = {"json": {"observation_id": source}} if isinstance(source, str) else _burst_body(source)
    return Call("POST", "/v1/scans", _read(ScanRequest.from_json), body=body)


def open_scan(scan_id: str) -> Call[ScanRequest]:
    """A scan that was begun before."""
    return Call("GET", f"/v1/scans/{scan_id}", _read(ScanRequest.from_json))


def add_views(scan_id: str, burst: Burst) -> Call[ScanRequest]:
    """Sends views for a scan, one or several; their cameras say where they were really taken from, in the scan's world frame."""
    return Call("POST", f"/v1/scans/{scan_id}/views", _read(ScanRequest.from_json), body=_burst_body(burst))


def complete_scan(scan_id: str, name: str | None = None) -> Call[Category]:
    """Makes the views of a scan a category, in one step."""
    return Call("POST", f"/v1/scans/{scan_id}/complete", _read(Category.from_json), body={"json": {"name": name}})


def forget_scan(scan_id: str) -> Call[None]:
    """Forgets a scan and its views; a category that it made stays."""
    return Call("DELETE", f"/v1/scans/{scan_id}", _nothing)


def categories() -> Call[list[Category]]:
    """All categories, oldest first."""
    return Call("GET", "/v1/categories", _read_list("categories", Category.from_json))


def category(category_id: str) -> Call[Category]:
    """One category."""
    return Call("GET", f"/v1/categories/{category_id}", _read(Category.from_json))


def rename(category_id: str, name: str | None) -> Call[Category]:
    """Says what people call a category; None takes the name away."""
    return Call("PATCH", f"/v1/categories/{category_id}", _read(Category.from_json), body={"json": {"name": name}})


def forget(category_id: str) -> Call[None]:
    """Deletes a category and what it was learnt from."""
    return Call("DELETE", f"/v1/categories/{category_id}", _nothing)


def info() -> Call[Info]:
    """The service's version, backbone, threshold and the size of its memory."""
    return Call("GET", "/v1/info", _read(Info.from_json))


def picture(path: str, **params: str | int) -> Call[bytes]:
    """A picture's PNG by its path, as `/v1/observations/{id}/overlay.png`; `params` are its query's, as `view=2`."""
    return Call("GET", path, lambda response: response.content, params)


def _burst_body(burst: Burst, frame: str | None = None, exact: bool = False) -> Body:
    if not exact:
        return {"files": burst_parts(burst, frame)}
    if frame is not None:
        raise InvalidInput("frame", f"an npz body has no place for one, found {frame!r}; leave out exact or frame")
    return {"content": burst_npz(burst), "headers": {"Content-Type": "application/x-npz"}}


def _read(make: Callable[[Mapping[str, Any]], T]) -> Callable[[httpx.Response], T]:
    return lambda response: make(response.json())


def _read_list(name: str, make: Callable[[Mapping[str, Any]], T]) -> Callable[[httpx.Response], list[T]]:
    return lambda response: [make(fields) for fields in response.json()[name]]


def _nothing(response: httpx.Response) -> None:
    """Of an answer without a body."""
