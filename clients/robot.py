"""A robot's client: bursts in, typed answers out.

robot = RobotClient("http://127.0.0.1:8000")
seen = robot.observe(burst)
if seen.scan is not None:
    for viewpoint in seen.scan:
        seen.scan.add(camera.capture(viewpoint))
    category = seen.scan.complete()
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import TracebackType
from typing import Any

import httpx

from clients.answers import Category, CategorySimilarity, Info, Outcome, Pose, ScanRequest, similarities_from_json
from clients.errors import TooSlow, Unreachable, problem_from_json
from clients.multipart import burst_parts
from core.views import Burst, FloatArray, View

DEFAULT_URL = "http://127.0.0.1:8000"
TIMEOUT_S = 120.0
"""For one answer: a slow machine needs about a second a view, and a scan has up to 32."""
CONNECT_TIMEOUT_S = 5.0


@dataclass(frozen=True, eq=False)
class Observation:
    """What the service says of one burst."""

    id: str
    outcome: Outcome
    category_id: str | None
    name: str | None
    """The category's name, where people gave it one."""
    pose: Pose | None
    """Of a known object."""
    pose_error: str | None
    """Why a known object has no pose."""
    scan: Scan | None
    """Of a novel object: to be carried out so that it becomes a category."""
    scan_error: str | None
    similarities: tuple[CategorySimilarity, ...]
    """Every category compared with, most similar first."""
    threshold: float | None
    """Least similarity of a known object; None where the request named the category."""
    timings_ms: Mapping[str, float]
    """Milliseconds of each stage in the service, and their `total`."""
    raw: Mapping[str, Any]
    """The answer's JSON."""


class Scan:
    """A scan to be carried out: iterate over its viewpoints, add a view for each, complete it."""

    def __init__(self, robot: RobotClient, request: ScanRequest) -> None:
        self._robot = robot
        self.request = request

    @property
    def id(self) -> str:
        """Names it in /v1/scans/{id}."""
        return self.request.id

    def __iter__(self) -> Iterator[FloatArray]:
        """The requested camera poses, each `world_from_camera` of shape (4, 4)."""
        return iter(self.request.world_from_camera)

    def __len__(self) -> int:
        return len(self.request.world_from_camera)

    def add(self, view: View) -> None:
        """Sends one view; its camera says where it was really taken from, in the burst's world frame."""
        self._robot.post(f"/v1/scans/{self.id}/views", files=burst_parts(Burst([view])))

    def complete(self, name: str | None = None) -> Category:
        """Makes the views a category, in one step."""
        return Category.from_json(self._robot.post(f"/v1/scans/{self.id}/complete", json={"name": name}))


class RobotClient:
    """Talks to one service. Every method raises what is in `clients.errors`; a context manager closes its connections."""

    def __init__(self, url: str = DEFAULT_URL, *, timeout_s: float = TIMEOUT_S, http: httpx.Client | None = None) -> None:
        """`http` replaces the connection (a test client, another transport); `url` and `timeout_s` are then its own."""
        timeout = httpx.Timeout(timeout_s, connect=min(timeout_s, CONNECT_TIMEOUT_S))
        self._http = http or httpx.Client(base_url=url, timeout=timeout)

    def __enter__(self) -> RobotClient:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Closes the connections."""
        self._http.close()

    def observe(self, burst: Burst, *, frame: str | None = None, **options: str | float | bool) -> Observation:
        """What `burst` shows: a known object with its pose, or a novel one with a scan to carry out.

        A known object's burst joins its category, unless `learn=False`. `options` are the request's: `learn`, `category_id`, `threshold`,
        `views_used`, `variant`, `seed`, `include`.
        """
        answer = self.post("/v1/observations", files=burst_parts(burst, frame), params=options)
        return Observation(
            id=answer["id"],
            outcome=answer["outcome"],
            category_id=answer["category_id"],
            name=answer["name"],
            pose=Pose.from_json(answer["pose"]) if answer["pose"] else None,
            pose_error=answer["pose_error"],
            scan=Scan(self, ScanRequest.from_json(answer["scan"])) if answer["scan"] else None,
            scan_error=answer["scan_error"],
            similarities=similarities_from_json(answer),
            threshold=answer["threshold"],
            timings_ms=answer["timings_ms"],
            raw=answer,
        )

    def scan(self, source: Burst | str) -> Scan:
        """A scan of the object of a burst, or of an earlier observation by its id, whatever was decided then."""
        body: dict[str, Any] = {"json": {"observation_id": source}} if isinstance(source, str) else {"files": burst_parts(source)}
        return Scan(self, ScanRequest.from_json(self.post("/v1/scans", **body)))

    def categories(self) -> list[Category]:
        """All categories, oldest first."""
        return [Category.from_json(fields) for fields in self._json("GET", "/v1/categories")["categories"]]

    def rename(self, category_id: str, name: str | None) -> Category:
        """Says what people call a category."""
        return Category.from_json(self._json("PATCH", f"/v1/categories/{category_id}", json={"name": name}))

    def forget(self, category_id: str) -> None:
        """Deletes a category and what it was learnt from."""
        self._send("DELETE", f"/v1/categories/{category_id}")

    def info(self) -> Info:
        """The service's version, backbone, threshold and the size of its memory."""
        return Info.from_json(self._json("GET", "/v1/info"))

    def picture(self, path: str, **params: str | int) -> bytes:
        """A picture's PNG, as `/v1/observations/{id}/overlay.png`."""
        return self._send("GET", path, params=params).content

    def post(self, path: str, **request: Any) -> dict[str, Any]:
        """The JSON answer to a POST; `request` as httpx takes it."""
        return self._json("POST", path, **request)

    def _json(self, method: str, path: str, **request: Any) -> dict[str, Any]:
        return dict(self._send(method, path, **request).json())

    def _send(self, method: str, path: str, **request: Any) -> httpx.Response:
        url = str(self._http.base_url).rstrip("/")
        try:
            response = self._http.request(method, path, **request)
        except (httpx.ConnectError, httpx.ConnectTimeout) as error:
            raise Unreachable(f"nothing answers at {url}; start the service with `onelook serve`, or give its address") from error
        except httpx.TimeoutException as error:
            raise TooSlow(f"{url} did not answer {method} {path} in time; send fewer views, or allow more time") from error
        except httpx.TransportError as error:
            raise Unreachable(f"the connection to {url} broke ({error}); look at the service's log") from error
        if response.is_error:
            raise problem_from_json(response.status_code, _problem(response))
        return response


def _problem(response: httpx.Response) -> Mapping[str, Any]:
    if response.headers.get("content-type", "").startswith("application/problem+json"):
        return dict(response.json())
    found = f"{response.url} answered {response.status_code} {response.reason_phrase}"
    return {"detail": f"{found}, which is no answer of this service; check the address"}
