"""The robot's client for asyncio: the methods of `clients.robot`, to be awaited.

async with AsyncRobotClient("http://127.0.0.1:8000") as robot:
    seen = await robot.observe(burst)
    if seen.scan is not None:
        for viewpoint in seen.scan:
            await seen.scan.add(await camera.look(viewpoint))
        category = await seen.scan.complete("cup")
"""

from __future__ import annotations

import asyncio
import functools
from collections.abc import AsyncIterator, Callable, Coroutine, Mapping, Sequence
from contextlib import AsyncExitStack
from types import TracebackType
from typing import Any, Concatenate, ParamSpec, TypeVar

import httpx
from websockets.asyncio.client import connect

from clients.answers.categories import Category
from clients.answers.observations import Observation
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
from clients.robot import CONNECT_TIMEOUT_S, DEFAULT_URL, TIMEOUT_S, timeouts, with_self
from clients.tracking import MAX_MESSAGE_BYTES, Conversation, Tracked, websocket_url
from core.views import Burst, View

P = ParamSpec("P")
T = TypeVar("T")
U = TypeVar("U")


def _method(
    call: Callable[P, Call[T]], wrap: Callable[[AsyncRobotClient, T], U]
) -> Callable[Concatenate[AsyncRobotClient, P], Coroutine[Any, Any, U]]:
    """As in `clients.robot`, to be awaited."""

    @functools.wraps(call)
    async def method(self: AsyncRobotClient, /, *args: P.args, **options: P.kwargs) -> U:
        return wrap(self, await self.send(call(*args, **options)))

    method.__signature__ = with_self(call)  # type: ignore[attr-defined]
    return method


def _as_is(robot: AsyncRobotClient, answer: T) -> T:
    return answer


def _scan(robot: AsyncRobotClient, request: ScanRequest) -> AsyncScan:
    return AsyncScan(robot, request)


def _scans(robot: AsyncRobotClient, requests: list[ScanRequest]) -> list[AsyncScan]:
    return [AsyncScan(robot, each) for each in requests]


def _observation(robot: AsyncRobotClient, seen: Observation[ScanRequest]) -> Observation[AsyncScan]:
    return seen.with_scan(lambda request: AsyncScan(robot, request))


def _observations(robot: AsyncRobotClient, seen: list[Observation[ScanRequest]]) -> list[Observation[AsyncScan]]:
    return [_observation(robot, each) for each in seen]


class AsyncScan(Viewpoints):
    """A scan to be carried out: iterate over its viewpoints, add a view for each, complete it."""

    def __init__(self, robot: AsyncRobotClient, request: ScanRequest) -> None:
        super().__init__(request)
        self._robot = robot

    async def add(self, view: View) -> tuple[str, ...]:
        """Sends one view; its camera says where it was really taken from, in the burst's world frame.

        Returns what is wrong with it, in words: better send another one from there.
        """
        self.request = await self._robot.send(scanning.add_views(self.id, Burst([view])))
        return self.request.faults[-1]

    async def exclude(self, viewpoints: Sequence[int]) -> None:
        """Has viewpoints that the robot cannot reach, given by their places, replaced by other ones: iterate again."""
        self.request = await self._robot.send(scanning.exclude_viewpoints(self.id, viewpoints))

    async def complete(self, name: str | None = None) -> Category:
        """Makes the views a category, in one step."""
        return await self._robot.send(scanning.complete_scan(self.id, name))


class AsyncRobotClient:
    """Talks to one service. Every method raises what is in `clients.errors`; a context manager closes its connections."""

    def __init__(
        self,
        url: str = DEFAULT_URL,
        *,
        api_key: str | None = None,
        timeout_s: float = TIMEOUT_S,
        retry: Retry | None = None,
        http: httpx.AsyncClient | None = None,
    ) -> None:
        """`api_key` is what `onelook keys create` told; the variable ONELOOK_API_KEY where it is left out.

        `http` replaces the connection (a test client, another transport); the others but `retry` are then its own.

        Raises InvalidInput where `url` is no address.
        """
        self._http = http or httpx.AsyncClient(base_url=address(url), timeout=timeouts(timeout_s), headers=key_header(api_key))
        self._retry = retry or Retry()

    async def __aenter__(self) -> AsyncRobotClient:
        return self

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        await self.close()

    async def close(self) -> None:
        """Closes the connections."""
        await self._http.aclose()

    async def send(self, call: Call[T]) -> T:
        """The answer to any of `clients.calls`."""
        steps = exchange(call, self._retry, str(self._http.base_url).rstrip("/"))
        step = next(steps)
        try:
            while True:
                step = steps.send(await self._carry_out(step))
        except StopIteration as done:
            answer: T = done.value
            return answer

    async def _carry_out(self, step: Call[T] | Wait) -> httpx.Response | httpx.TransportError | None:
        if isinstance(step, Wait):
            await asyncio.sleep(step.seconds)
            return None
        try:
            return await self._http.request(step.method, step.path, params=step.params, **step.body)
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

    async def events(self, after: int | None = None) -> AsyncIterator[Event]:
        """As `RobotClient.events`: `async for event in robot.events()`."""
        reader, url = EventReader(), str(self._http.base_url).rstrip("/")
        params = {} if after is None else {"after": after}
        try:
            async with self._http.stream("GET", EVENTS, params=params, timeout=endless(self._http.timeout)) as response:
                if not is_answer(response):
                    await response.aread()
                    raise problem_of(response)
                async for line in response.aiter_lines():
                    if (event := reader.feed(line)) is not None:
                        yield event
        except httpx.TransportError as error:
            raise broken(error, url) from None

    def track(self, category_id: str | None = None, **options: Any) -> AsyncTrack:
        """As `RobotClient.track`: `async with robot.track() as track: tracked = await track.step(view)`."""
        url = websocket_url(str(self._http.base_url))
        return AsyncTrack(url, {"category_id": category_id, **options}, authorization(self._http.headers))


class AsyncTrack:
    """A connection that follows one object; an asynchronous context manager."""

    def __init__(self, url: str, options: Mapping[str, Any], headers: Mapping[str, str]) -> None:
        self._url = url
        self._headers = headers
        self._talk = Conversation()
        self._hello = self._talk.hello(**options)
        self._open = AsyncExitStack()

    async def __aenter__(self) -> AsyncTrack:
        """Raises Unreachable, or the ServiceProblem that the service answers."""
        with connection_to(self._url):
            async with AsyncExitStack() as opening:
                opened = connect(self._url, additional_headers=self._headers, max_size=MAX_MESSAGE_BYTES, open_timeout=CONNECT_TIMEOUT_S)
                self._socket = await opening.enter_async_context(opened)
                await self._socket.send(self._hello)
                self._talk.read(await self._socket.recv())
                self._open = opening.pop_all()
        return self

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        await self._open.aclose()

    async def step(self, view: View, time_s: float | None = None) -> Tracked:
        """As `Track.step`."""
        with connection_to(self._url):
            await self._socket.send(self._talk.frame(view, time_s))
            while (answer := self._talk.read(await self._socket.recv())) is None:
                pass
            return answer
