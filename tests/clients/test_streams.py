"""Events and tracking, against a service, synchronous and asynchronous."""

from __future__ import annotations

import asyncio
from dataclasses import replace

import numpy as np
import pytest

from clients import errors
from clients.answers.categories import Category
from clients.asynchronous import AsyncRobotClient
from clients.events import Event, EventReader
from clients.robot import RobotClient
from clients.tracking import Conversation
from core.errors import InvalidInput
from core.views import Burst, View


def test_lines_make_events() -> None:
    reader = EventReader()
    lines = ["id: 7", "event: scan_begun", 'data: {"created_at": "now",', 'data: "scan_id": "s"}', "", ": still here", ""]
    assert [event for line in lines if (event := reader.feed(line))] == [Event(7, "scan_begun", "now", {"scan_id": "s"})]


def test_what_happened_is_told_from_where_one_left_off(robot: RobotClient, learnt: Category) -> None:
    told: list[Event] = []
    for event in robot.events(after=0):
        told.append(event)
        if event.kind == "category_created":
            break
    assert told[0].kind == "scan_begun"
    robot.rename(learnt.id, "auto")
    renamed = next(robot.events(after=told[-1].id))
    assert (renamed.kind, renamed.id > told[-1].id) == ("category_renamed", True)


def test_events_are_told_asynchronously_too(url: str, learnt: Category) -> None:
    async def first() -> Event:
        async with AsyncRobotClient(url) as robot:
            async for event in robot.events(after=0):
                return event
        raise AssertionError

    assert asyncio.run(first()).kind == "scan_begun"


def test_an_object_is_followed(robot: RobotClient, learnt: Category, burst: Burst) -> None:
    with robot.track(learnt.id, window=4) as track:
        answers = [track.step(view, time_s=0.1 * number) for number, view in enumerate(burst.views)]
    assert [answer.frame_id for answer in answers] == [0, 1, 2, 3]
    last = answers[-1]
    assert last.category_id == learnt.id
    assert last.pose is not None
    np.testing.assert_allclose(last.pose.target_from_reference.as_matrix(), np.eye(4), atol=0.05)
    assert last.pose.world_from_object.shape == (4, 4)
    assert "found" in {change for answer in answers for change in answer.changes}


def test_an_object_is_followed_asynchronously_too(url: str, learnt: Category, burst: Burst) -> None:
    async def follow() -> int:
        async with AsyncRobotClient(url) as robot, robot.track(learnt.id) as track:
            return (await track.step(burst.views[0])).frame_id

    assert asyncio.run(follow()) == 0


def test_what_cannot_be_followed_is_said(robot: RobotClient, burst: Burst) -> None:
    with pytest.raises(errors.NotFoundProblem), robot.track("nobody"):
        pass
    with pytest.raises(errors.InvalidInputProblem, match="window"), robot.track(window=99):
        pass
    with robot.track() as track, pytest.raises(InvalidInput, match="depth"):
        track.step(View(burst.views[0].rgb))


def test_a_frames_depth_that_reaches_too_far_is_named(burst: Burst) -> None:
    far = replace(burst.views[0], depth_m=np.full(burst.views[0].size, 80, np.float32))
    with pytest.raises(InvalidInput) as caught:
        Conversation().frame(far)
    assert caught.value.field == "depth"


def test_without_a_service_the_remedy_is_said() -> None:
    robot = RobotClient("http://127.0.0.1:9")
    with pytest.raises(errors.Unreachable, match="onelook serve"), robot.track():
        pass
    with pytest.raises(errors.Unreachable, match="onelook serve"):
        next(robot.events())


def test_a_refused_stream_is_a_problem(robot: RobotClient) -> None:
    with pytest.raises(errors.InvalidInputProblem, match="after"):
        next(robot.events(after=-1))
