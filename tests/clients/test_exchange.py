"""What is sent again, after how long, and what is not: against answers that are given in turn."""

from __future__ import annotations

import asyncio
import socket
import traceback
from collections.abc import Callable, Iterator
from datetime import datetime, timedelta, timezone
from email.utils import format_datetime

import httpx
import numpy as np
import pytest

from clients import errors
from clients.asynchronous import AsyncRobotClient
from clients.exchange import KEY, Retry, retry_after_s
from clients.robot import RobotClient
from core.views import Burst, View

CATEGORIES = httpx.Response(200, json={"categories": []})
SCAN = {
    "id": "s",
    "center_m": [0, 0, 0],
    "up": [0, 0, 1],
    "radius_m": 1,
    "world_from_camera": [np.eye(4).tolist()],
    "extent_m": 0.2,
    "covered": [False],
    "received": [],
    "views": 1,
    "views_required": 2,
}
BURST = Burst([View(np.zeros((32, 32, 3), np.uint8))])
BROKEN = httpx.ReadError("cut off")


def problem(status: int, name: str, **headers: str) -> httpx.Response:
    body = {"type": f"{errors.PROBLEM_URN}{name}", "title": "Busy", "detail": "all lanes are taken"}
    return httpx.Response(status, json=body, headers={"content-type": "application/problem+json", **headers})


class Turns:
    """A transport that answers each request with the next of its answers, and keeps what it was asked."""

    def __init__(self, *answers: httpx.Response | Exception) -> None:
        self.answers = list(answers)
        self.requests: list[httpx.Request] = []

    def __call__(self, request: httpx.Request) -> httpx.Response:
        self.requests.append(request)
        answer = self.answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer

    @property
    def keys(self) -> list[str]:
        """The idempotency keys that came."""
        return [request.headers[KEY] for request in self.requests]


Connect = Callable[..., tuple[RobotClient, Turns]]


@pytest.fixture
def waits(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The waits between attempts, which take no time."""
    slept: list[float] = []
    monkeypatch.setattr("clients.robot.time.sleep", slept.append)
    return slept


@pytest.fixture
def connect(waits: list[float]) -> Connect:
    """connect(*answers, retry=…): a client, and the transport that gives it these answers."""

    def make(*answers: httpx.Response | Exception, retry: Retry | None = None) -> tuple[RobotClient, Turns]:
        turns = Turns(*answers)
        http = httpx.Client(transport=httpx.MockTransport(turns), base_url="http://robot.test")
        return RobotClient(http=http, retry=retry), turns

    return make


def test_a_change_is_sent_again_under_the_same_key(connect: Connect, waits: list[float]) -> None:
    robot, turns = connect(BROKEN, httpx.ConnectError("refused"), httpx.Response(200, json=SCAN))
    assert robot.scan(BURST).id == "s"
    assert len(set(turns.keys)) == 1
    assert turns.requests[0].content == turns.requests[2].content
    assert len(waits) == 2


def test_each_change_has_a_key_of_its_own(connect: Connect) -> None:
    robot, turns = connect(httpx.Response(200, json=SCAN), httpx.Response(200, json=SCAN))
    robot.scan(BURST)
    robot.scan(BURST)
    assert len(set(turns.keys)) == 2


def test_waits_grow_and_are_bounded(connect: Connect, waits: list[float]) -> None:
    robot, _ = connect(*[BROKEN] * 5, CATEGORIES, retry=Retry(attempts=6, first_s=1, longest_s=4))
    robot.categories()
    for wait, most in zip(waits, [1, 2, 4, 4, 4], strict=True):
        assert most / 2 <= wait <= most


def test_the_last_failure_is_told(connect: Connect) -> None:
    robot, turns = connect(BROKEN, BROKEN, BROKEN, retry=Retry(attempts=3))
    with pytest.raises(errors.Unreachable, match="cut off"):
        robot.categories()
    assert len(turns.requests) == 3


def test_a_busy_service_is_asked_again_when_it_says(connect: Connect, waits: list[float]) -> None:
    robot, _ = connect(problem(503, "unavailable", **{"retry-after": "7"}), problem(429, "busy", **{"retry-after": "2"}), CATEGORIES)
    assert robot.categories() == []
    assert waits == [7, 2]


def test_a_request_that_is_still_being_carried_out_is_asked_for_again(connect: Connect, waits: list[float]) -> None:
    robot, turns = connect(BROKEN, problem(409, "conflict", **{"retry-after": "1"}), httpx.Response(200, json=SCAN))
    assert robot.scan(BURST).id == "s"
    assert waits[1] == 1
    assert len(set(turns.keys)) == 1


def test_a_service_that_asks_for_patience_beyond_ours_is_unavailable(connect: Connect, waits: list[float]) -> None:
    robot, turns = connect(problem(503, "unavailable", **{"retry-after": "600"}))
    with pytest.raises(errors.UnavailableProblem, match="all lanes are taken") as caught:
        robot.categories()
    assert caught.value.retry_after_s == 600
    assert (len(turns.requests), waits) == (1, [])


@pytest.mark.parametrize(
    "answer", [problem(503, "unavailable"), problem(409, "conflict"), problem(422, "invalid-input"), httpx.Response(500)]
)
def test_what_waiting_does_not_mend_is_not_sent_again(connect: Connect, answer: httpx.Response) -> None:
    robot, turns = connect(answer)
    with pytest.raises(errors.ServiceProblem):
        robot.categories()
    assert len(turns.requests) == 1


def test_a_proxy_before_a_restarting_service_is_asked_again(connect: Connect) -> None:
    robot, turns = connect(httpx.Response(502, text="<html>"), httpx.Response(503, text="<html>"), CATEGORIES)
    assert robot.categories() == []
    assert len(turns.requests) == 3


def test_an_answer_that_takes_too_long_is_not_waited_for_twice(connect: Connect) -> None:
    robot, turns = connect(httpx.ReadTimeout("late"))
    with pytest.raises(errors.TooSlow, match="allow more time"):
        robot.scan(BURST)
    assert len(turns.requests) == 1


def test_a_deletion_whose_answer_was_lost_is_done(connect: Connect) -> None:
    robot, _ = connect(BROKEN, problem(404, "not-found"))
    robot.forget("c")
    robot, _ = connect(problem(404, "not-found"))
    with pytest.raises(errors.NotFoundProblem):
        robot.forget("c")


@pytest.fixture
def refusing() -> Iterator[str]:
    """An address at which nothing listens: its port is taken."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        yield f"http://127.0.0.1:{taken.getsockname()[1]}"


def asynchronously(url: str) -> None:
    async def ask() -> None:
        async with AsyncRobotClient(url, retry=Retry(attempts=1)) as robot:
            await robot.categories()

    asyncio.run(ask())


async def _told(url: str) -> None:
    async with AsyncRobotClient(url) as robot:
        async for _ in robot.events():
            pass


async def _followed(url: str) -> None:
    async with AsyncRobotClient(url).track():
        pass


@pytest.mark.parametrize(
    "ask",
    [
        lambda url: RobotClient(url, retry=Retry(attempts=1)).categories(),
        lambda url: next(RobotClient(url).events()),
        lambda url: RobotClient(url).track().__enter__(),
        asynchronously,
        lambda url: asyncio.run(_told(url)),
        lambda url: asyncio.run(_followed(url)),
    ],
    ids=["asked", "events", "track", "asked by asyncio", "events by asyncio", "track by asyncio"],
)
def test_a_failure_is_one_exception_with_the_reason(ask: Callable[[str], object], refusing: str) -> None:
    try:
        raise FileNotFoundError(2, "what the caller handles meanwhile")
    except FileNotFoundError:
        with pytest.raises(errors.Unreachable, match=r"^no connection to .*(refused|Connect call failed)") as caught:
            ask(refusing)
    assert refusing.removeprefix("http") in str(caught.value)
    assert "".join(traceback.format_exception(caught.value)).count("Traceback") == 1


def test_a_failure_that_says_nothing_is_told_by_its_kind(connect: Connect) -> None:
    robot, _ = connect(httpx.ConnectTimeout(""), retry=Retry(attempts=1))
    with pytest.raises(errors.Unreachable, match="ConnectTimeout"):
        robot.categories()


def test_a_connection_that_did_not_last_broke(connect: Connect) -> None:
    robot, _ = connect(httpx.ReadError("reset by peer"), retry=Retry(attempts=1))
    with pytest.raises(errors.Unreachable, match=r"the connection to .* broke \(reset by peer\); look at the service's log"):
        robot.categories()


def test_retry_after_may_be_a_date() -> None:
    later = format_datetime(datetime.now(timezone.utc) + timedelta(seconds=60), usegmt=True)
    assert retry_after_s({"retry-after": later}) == pytest.approx(60, abs=2)
    assert retry_after_s({"retry-after": "Fri, 01 Jan 2010 00:00:00 GMT"}) == 0
    assert retry_after_s({"retry-after": "soon"}) is None
    assert retry_after_s({"retry-after": "nan"}) is None
    assert retry_after_s({}) is None
