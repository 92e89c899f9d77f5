"""Load and soak: what they count, and what they refuse."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks import load, soak
from benchmarks.crowd import Attempt, Record, Sample, crowd
from clients.asynchronous import AsyncRobotClient
from clients.errors import ServiceProblem, Unreachable
from core.errors import InvalidInput
from service.settings import Settings

PASS_S = 0.1
"""Of the backbone; encoding a burst takes two."""


@pytest.fixture
def url(tmp_path: Path, backbone: Any, serving: Any, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """A service with one worker and one place in its queue, whose backbone takes long enough for the queue to fill."""
    quick = backbone.extract

    def extract(images: Any) -> Any:
        time.sleep(PASS_S)
        return quick(images)

    monkeypatch.setattr(backbone, "extract", extract)
    small = Settings(data_dir=tmp_path / "memory", variant="ucd", score="pooled_best_view", workers=1, queue=1)
    with serving(small, backbone) as address:
        yield address


def test_more_robots_than_places_are_refused_and_nobody_fails(url: str, recorded: Path, tmp_path: Path) -> None:
    rows = load.run(tmp_path / "load.json", tmp_path / "load.png", robots=[1, 6], seconds=2.5, views=3, data=recorded, url=url, seed=0)
    alone, crowded = rows
    assert (alone.robots, alone.refused, alone.failed) == (1, 0, 0)
    assert alone.answered > 0
    assert 0 < alone.p50_s <= alone.p95_s <= alone.p99_s
    assert crowded.refused > 0
    assert crowded.failed == 0
    assert 0 < alone.cpu_s < 2
    assert crowded.waiting_max == 1
    written = json.loads((tmp_path / "load.json").read_text())
    assert [row["robots"] for row in written["rows"]] == [1, 6]
    assert (tmp_path / "load.png").stat().st_size > 10_000


def test_load_is_put_on_this_machine_only(recorded: Path) -> None:
    with pytest.raises(InvalidInput, match="of this machine"):
        load.run(None, None, robots=[1], seconds=1, views=3, data=recorded, url="http://robot.example:8000", seed=0)


def test_more_views_than_were_recorded_are_refused_before_anything_is_asked(recorded: Path) -> None:
    with pytest.raises(InvalidInput, match="^views: 9 were asked for, but egg/large has 4"):
        load.run(None, None, robots=[1], seconds=1, views=9, data=recorded, url="http://127.0.0.1:9", seed=0)
    with pytest.raises(InvalidInput, match="^views: 9 were asked for, but egg/large has 4"):
        soak.run(None, None, minutes=1, most_growth=0.05, robots=1, views=9, data=recorded, url="http://127.0.0.1:9", seed=0)


def test_fates_are_told_apart_and_refused_robots_wait(url: str) -> None:
    told = iter([None, ServiceProblem("full", status=503, retry_after_s=0.2), ServiceProblem("bad", status=422), Unreachable("gone")])

    async def errand(robot: AsyncRobotClient, rng: np.random.Generator) -> None:
        what = next(told, None)
        await asyncio.sleep(0.01)
        if what is not None:
            raise what

    record = asyncio.run(crowd(url, 1, 1.0, errand, tell=lambda record: None))
    assert [attempt.fate for attempt in record.attempts[:4]] == ["answered", "refused", "failed", "failed"]
    assert record.attempts[2].ended_s - record.attempts[1].ended_s > 0.2
    assert record.attempts[2].why == "422 bad"
    assert all(sample.resident_mb > 10 for sample in record.samples)


def grown(per_minute_mb: float) -> Record:
    """30 minutes of a process that grows at the start, and then by so much."""
    times = np.arange(0, 1800, 3.0)
    sizes = 700 + 200 * np.minimum(times / 300, 1) + per_minute_mb * times / 60
    return Record([Attempt(60.0, 1.0, "answered")], [Sample(t, mb, 1, 0) for t, mb in zip(times, sizes)])


def test_growth_is_of_the_settled_process() -> None:
    flat = soak.soak_result(30, 2, grown(0))
    assert (flat.early_mb, flat.late_mb, flat.growth) == (900, 900, 0)
    busy = [replace(sample, resident_mb=sample.resident_mb + 50 * (index % 3)) for index, sample in enumerate(grown(0).samples)]
    assert soak.soak_result(30, 2, Record([], busy)).growth == 0  # what requests under way take, they give back
    leaking = soak.soak_result(30, 2, grown(5))
    assert leaking.growth == pytest.approx((5 * 15) / (900 + 5 * 10), rel=0.02)


def test_a_process_that_grows_or_fails_is_told(url: str, recorded: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    half_an_hour = partial(soak.run, None, None, minutes=30, most_growth=0.05, robots=2, views=4, seed=0)
    monkeypatch.setattr(soak, "_soak", lambda *_: grown(5))
    with pytest.raises(InvalidInput, match=r"growth: the process grew by 7\.\d %"):
        half_an_hour(data=recorded, url=url)
    failed = grown(0)
    failed.attempts.append(Attempt(61.0, 1.0, "failed", "500 unexpected"))
    monkeypatch.setattr(soak, "_soak", lambda *_: failed)
    with pytest.raises(InvalidInput, match="1 errands failed, the first with: 500 unexpected"):
        half_an_hour(data=recorded, url=url)
