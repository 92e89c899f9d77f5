"""What happens is told, to as many as listen and however slowly."""

from __future__ import annotations

import asyncio
import json
import threading

import httpx
import pytest

from service.events import BACKLOG, HISTORY, Events


def collect(events, count, after=None, meanwhile=lambda: None):
    """The first `count` events that a listener gets, with `meanwhile` happening once it listens."""

    async def listen():
        listening = events.listen(after)
        first = asyncio.ensure_future(anext(listening))
        await asyncio.sleep(0)
        meanwhile()
        found = [await asyncio.wait_for(first, 5)]
        while len(found) < count:
            found.append(await asyncio.wait_for(anext(listening), 5))
        await listening.aclose()
        return found

    return asyncio.run(listen())


def test_a_listener_hears_what_happens_from_then_on():
    events = Events()
    events.publish("scan_begun", id="before")
    heard = collect(events, 2, meanwhile=lambda: [events.publish("observation", id=str(number)) for number in range(2)])
    assert [(event.kind, event.about["id"]) for event in heard] == [("observation", "0"), ("observation", "1")]
    assert heard[1].id == heard[0].id + 1


def test_who_comes_back_hears_what_was_missed():
    events = Events()
    for number in range(4):
        events.publish("observation", number=number)
    assert [event.about["number"] for event in collect(events, 2, after=2)] == [2, 3]


def test_what_is_older_than_the_history_is_counted():
    events = Events()
    for _ in range(HISTORY + 5):
        events.publish("observation")
    heard = collect(events, 2, after=0)
    assert (heard[0].kind, heard[0].about) == ("dropped", {"events": 5})
    assert heard[1].id == 6


def test_a_slow_listener_loses_the_oldest_and_is_told():
    events = Events()
    heard = collect(events, 2, meanwhile=lambda: [events.publish("observation") for _ in range(BACKLOG + 7)])
    assert (heard[0].kind, heard[0].about["events"], heard[1].id) == ("dropped", 7, 8)


def test_nobody_waits_for_a_service_that_ends():
    events = Events()

    async def listen():
        return [event async for event in events.listen()]

    async def end():
        listening = asyncio.ensure_future(listen())
        await asyncio.sleep(0)
        events.close()
        return await asyncio.wait_for(listening, 5)

    assert asyncio.run(end()) == []


@pytest.fixture
def stream(live):
    """stream(count, **headers): that many server-sent events of the live service, as (event, id, data)."""

    def read(count, **headers):
        found, event = [], {}
        with httpx.stream("GET", f"{live}/v1/events", params={"after": 0}, headers=headers, timeout=10) as answer:
            assert answer.headers["content-type"].startswith("text/event-stream")
            for line in answer.iter_lines():
                if line:
                    name, _, value = line.partition(": ")
                    event[name] = value
                elif event:
                    found.append((event["event"], int(event["id"]), json.loads(event["data"])))
                    event = {}
                if len(found) == count:
                    break
        return found

    return read


def test_events_are_streamed_as_they_happen(live, stream, look, parts):
    heard = []
    listening = threading.Thread(target=lambda: heard.extend(stream(3)))
    listening.start()
    seen = httpx.post(f"{live}/v1/observations", files=parts(look())).json()
    scan = httpx.post(f"{live}/v1/scans", json={"observation_id": seen["id"]}).json()
    httpx.delete(f"{live}/v1/scans/{scan['id']}")
    listening.join(10)
    assert [(kind, data["id"]) for kind, _, data in heard] == [
        ("observation", seen["id"]),
        ("scan_begun", scan["id"]),
        ("scan_deleted", scan["id"]),
    ]
    assert heard[0][2]["outcome"] == "novel"
    assert [kind for kind, _, _ in stream(1, **{"Last-Event-ID": "2"})] == ["scan_deleted"]


@pytest.mark.parametrize("said", ["9" * 5000, "-2", "two"])
def test_a_last_id_that_nobody_gave_says_nothing(live, stream, look, parts, said):
    httpx.post(f"{live}/v1/observations", files=parts(look()))
    assert [kind for kind, _, _ in stream(1, **{"Last-Event-ID": said})] == ["observation"]
