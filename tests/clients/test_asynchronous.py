"""The asynchronous client has the synchronous one's methods, and its loop."""

from __future__ import annotations

import asyncio
import inspect

import httpx
import numpy as np
import pytest

from clients import errors
from clients.asynchronous import AsyncRobotClient
from clients.datasets.folders import Sequence, load_burst
from clients.robot import RobotClient


def public(kind: type) -> dict[str, inspect.Signature]:
    return {name: inspect.signature(member) for name, member in inspect.getmembers(kind, callable) if not name.startswith("_")}


def test_both_clients_have_the_same_methods_with_the_same_arguments() -> None:
    own, other = public(AsyncRobotClient), public(RobotClient)
    assert {name: own[name].parameters for name in own} == {name: other[name].parameters for name in other}
    waited_for = public(AsyncRobotClient).keys() - {"events", "track"}  # of which the one is iterated over, the other entered
    assert all(inspect.iscoroutinefunction(getattr(AsyncRobotClient, name)) for name in waited_for)


def test_a_novel_object_is_scanned_learnt_and_recognised(url: str, recordings: list[Sequence]) -> None:
    async def meet() -> None:
        burst = load_burst(recordings[0], range(4))
        async with AsyncRobotClient(url) as robot:
            seen = await robot.observe(burst)
            assert seen.scan is not None
            assert len(list(seen.scan)) == len(seen.scan) == 10
            for view in burst.views:
                await seen.scan.add(view)
            assert seen.scan.request.views == 4
            category = await seen.scan.complete("car")
            again = await robot.observe(burst)
            assert (again.outcome, again.category_id) == ("known", category.id)
            assert again.pose is not None
            np.testing.assert_allclose(again.pose.matrix, np.eye(4), atol=0.02)
            assert [each.id for each in await robot.observations(limit=2)] == [again.id, seen.id]

    asyncio.run(meet())


def test_it_sends_again_and_names_problems_too(monkeypatch: pytest.MonkeyPatch) -> None:
    waits: list[float] = []

    async def sleep(seconds: float) -> None:
        waits.append(seconds)

    def answer(request: httpx.Request) -> httpx.Response:
        if not waits:
            raise httpx.ConnectError("refused")
        problem = {"type": f"{errors.PROBLEM_URN}not-found", "title": "There is no such thing", "detail": "no category has the id x"}
        return httpx.Response(404, json=problem, headers={"content-type": "application/problem+json"})

    async def ask() -> None:
        monkeypatch.setattr("clients.asynchronous.asyncio.sleep", sleep)
        http = httpx.AsyncClient(transport=httpx.MockTransport(answer), base_url="http://robot.test")
        async with AsyncRobotClient(http=http) as robot:
            with pytest.raises(errors.NotFoundProblem, match="no category has the id x"):
                await robot.category("x")

    asyncio.run(ask())
    assert len(waits) == 1
