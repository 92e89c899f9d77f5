"""A robot's client: bursts in, typed answers out.

robot = RobotClient("http://127.0.0.1:8000")
seen = robot.observe(burst)
if seen.scan is not None:
    for viewpoint in seen.scan:
        seen.scan.add(camera.look(viewpoint))
    category = seen.scan.complete("cup")

`clients.asynchronous.AsyncRobotClient` has the same methods, to be awaited; `clients.calls` says what each does.
"""

from __future__ import annotations

import functools
import inspect
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from types import TracebackType
from typing import Any, Concatenate, ParamSpec, TypeVar

import httpx
from websockets.sync.client import connect

from clients.answers.categories import Category
from clients.answers.observations import Observation as Answered
from clients.answers.scans import ScanRequest, Viewpoints
from clients.calls import curating, observing, operating, rearranging, scanning
from clients.calls.call import Call
from clients.events import PATH as EVENTS
from clients.events import Event, EventReader
from clients.exchange import (
    Retry,
    Wait,
    address,
    authorization,
    broken,
    connection_to,
    endless,
    exchange,
    is_answer,
    key_header,
    problem_of,
)
from clients.tracking import MAX_MESSAGE_BYTES, Conversation, Tracked, websocket_url
from core.views import Burst, View

DEFAULT_URL = "http://127.0.0.1:8000"
TIMEOUT_S = 120.0
"""For one answer: a slow machine needs about a second a view, and a scan has up to 32."""
CONNECT_TIMEOUT_S = 5.0
P = ParamSpec("P")
T = TypeVar("T")
U = TypeVar("U")


def _method(call: Callable[P, Call[T]], wrap: Callable[[RobotClient, T], U]) -> Callable[Concatenate[RobotClient, P], U]:
    """A client's method that sends what `call` makes of its arguments, and gives back `wrap(client, answer)`."""

    @functools.wraps(call)
    def method(self: RobotClient, /, *args: P.args, **options: P.kwargs) -> U:
        return wrap(self, self.send(call(*args, **options)))

    method.__signature__ = with_self(call)  # type: ignore[attr-defined]
    return method


def with_self(function: Callable[..., object]) -> inspect.Signature:
    """What `help` shows of the method made from `function`."""
    signature = inspect.signature(function)
    own = inspect.Parameter("self", inspect.Parameter.POSITIONAL_ONLY)
    return signature.replace(parameters=[own, *signature.parameters.values()], return_annotation=inspect.Signature.empty)


def _as_is(robot: RobotClient, answer: T) -> T:
    return answer


def _scan(robot: RobotClient, request: ScanRequest) -> Scan:
    return Scan(robot, request)


def _scans(robot: RobotClient, requests: list[ScanRequest]) -> list[Scan]:
    return [Scan(robot, each) for each in requests]


def _observation(robot: RobotClient, seen: Answered[ScanRequest]) -> Observation:
    return seen.with_scan(lambda request: Scan(robot, request))


def _observations(robot: RobotClient, seen: list[Answered[ScanRequest]]) -> list[Observation]:
    return [_observation(robot, each) for each in seen]


class Scan(Viewpoints):
    """A scan to be carried out: iterate over its viewpoints, add a view for each, complete it."""

    def __init__(self, robot: RobotClient, request: ScanRequest) -> None:
        super().__init__(request)
        self._robot = robot

    def add(self, view: View) -> tuple[str, ...]:
        """Sends one view; its camera says where it was really taken from, in the burst's world frame.

        Returns what is wrong with it, in words: better send another one from there.
        """
        self.request = self._robot.send(scanning.add_views(self.id, Burst([view])))
        return self.request.faults[-1]

    def exclude(self, viewpoints: Sequence[int]) -> None:
        """Has viewpoints that the robot cannot reach, given by their places, replaced by other ones: iterate again."""
        self.request = self._robot.send(scanning.exclude_viewpoints(self.id, viewpoints))

    def complete(self, name: str | None = None) -> Category:
        """Makes the views a category, in one step."""
        return self._robot.send(scanning.complete_scan(self.id, name))


Observation = Answered[Scan]
"""What the service says of one burst, with a scan that can be carried out."""


class RobotClient:
    """Talks to one service. Every method raises what is in `clients.errors`; a context manager closes its connections."""

    def __init__(
        self,
        url: str = DEFAULT_URL,
        *,
        api_key: str | None = None,
        timeout_s: float = TIMEOUT_S,
        retry: Retry | None = None,
        http: httpx.Client | None = None,
    ) -> None:
        """`api_key` is what `onelook keys create` told; the variable ONELOOK_API_KEY where it is left out.

        `http` replaces the connection (a test client, another transport); the others but `retry` are then its own.

        Raises InvalidInput where `url` is no address.
        """
        self._http = http or httpx.Client(base_url=address(url), timeout=timeouts(timeout_s), headers=key_header(api_key))
        self._retry = retry or Retry()

    def __enter__(self) -> RobotClient:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Closes the connections."""
        self._http.close()

    def send(self, call: Call[T]) -> T:
        """The answer to any of `clients.calls`."""
        steps = exchange(call, self._retry, str(self._http.base_url).rstrip("/"))
        step = next(steps)
        try:
            while True:
                step = steps.send(self._carry_out(step))
        except StopIteration as done:
            answer: T = done.value
            return answer

    def _carry_out(self, step: Call[T] | Wait) -> httpx.Response | httpx.TransportError | None:
        if isinstance(step, Wait):
            time.sleep(step.seconds)
            return None
        try:
            return self._http.request(step.method, step.path, params=step.params, **step.body)
        except httpx.TransportError as error:
            return error

    observe = _method(observing.observe, _observation)
    observation = _method(observing.observation, _observation)
    observations = _method(observing.observations, _observations)
    correct = _method(observing.correct, _observation)
    detections = _method(observing.detections, _as_is)
    picture = _method(observing.picture, _as_is)
    scan = _method(scanning.scan, _scan)
    scans = _method(scanning.scans, _scans)
    open_scan = _method(scanning.open_scan, _scan)
    forget_scan = _method(scanning.forget_scan, _as_is)
    categories = _method(curating.categories, _as_is)
    category = _method(curating.category, _as_is)
    rename = _method(curating.rename, _as_is)
    forget = _method(curating.forget, _as_is)
    merge = _method(curating.merge, _as_is)
    split = _method(curating.split, _as_is)
    instances = _method(curating.instances, _as_is)
    forget_instance = _method(curating.forget_instance, _as_is)
    similarities = _method(curating.similarities, _as_is)
    cloud = _method(curating.cloud, _as_is)
    set_goal = _method(rearranging.set_goal, _as_is)
    goals = _method(rearranging.goals, _as_is)
    goal = _method(rearranging.goal, _as_is)
    forget_goal = _method(rearranging.forget_goal, _as_is)
    plan = _method(rearranging.plan, _as_is)
    info = _method(operating.info, _as_is)
    memory = _method(operating.memory, _as_is)
    calibrate = _method(operating.calibrate, _as_is)
    backup = _method(operating.backup, _as_is)
    export_memory = _method(operating.export_memory, _as_is)
    import_memory = _method(operating.import_memory, _as_is)

    def events(self, after: int | None = None) -> Iterator[Event]:
        """What happens in the service, as it happens, without end; first what happened after the event with the id `after`.

        Raises Unreachable where the connection breaks: go on from the last event's id.
        """
        reader, url = EventReader(), str(self._http.base_url).rstrip("/")
        params = {} if after is None else {"after": after}
        try:
            with self._http.stream("GET", EVENTS, params=params, timeout=endless(self._http.timeout)) as response:
                if not is_answer(response):
                    response.read()
                    raise problem_of(response)
                for line in response.iter_lines():
                    if (event := reader.feed(line)) is not None:
                        yield event
        except httpx.TransportError as error:
            raise broken(error, url) from None

    def track(self, category_id: str | None = None, **options: Any) -> Track:
        """Follows an object, of a category or of one that the first frames decide; `options` are `window`, `variant`, `weight`, `seed`.

        with robot.track() as track:
            for view in camera:
                tracked = track.step(view)
        """
        url = websocket_url(str(self._http.base_url))
        return Track(url, {"category_id": category_id, **options}, authorization(self._http.headers))


class Track:
    """A connection that follows one object; a context manager."""

    def __init__(self, url: str, options: Mapping[str, Any], headers: Mapping[str, str]) -> None:
        self._url = url
        self._headers = headers
        self._talk = Conversation()
        self._hello = self._talk.hello(**options)
        self._open = ExitStack()

    def __enter__(self) -> Track:
        """Raises Unreachable, or the ServiceProblem that the service answers."""
        with ExitStack() as opening, connection_to(self._url):
            self._socket = opening.enter_context(
                connect(self._url, additional_headers=self._headers, max_size=MAX_MESSAGE_BYTES, open_timeout=CONNECT_TIMEOUT_S)
            )
            self._socket.send(self._hello)
            self._talk.read(self._socket.recv())
            self._open = opening.pop_all()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._open.close()

    def step(self, view: View, time_s: float | None = None) -> Tracked:
        """Where the object is in this view, taken at `time_s` on any clock. Raises the ServiceProblem of a view that cannot be used."""
        with connection_to(self._url):
            self._socket.send(self._talk.frame(view, time_s))
            while (answer := self._talk.read(self._socket.recv())) is None:
                pass
            return answer


def timeouts(timeout_s: float) -> httpx.Timeout:
    """`timeout_s` for an answer, less for a connection."""
    return httpx.Timeout(timeout_s, connect=min(timeout_s, CONNECT_TIMEOUT_S))
