"""The tracking bench: what becomes of each frame, from the messages of a service."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from benchmarks import track
from benchmarks.track import Stream
from core.errors import InvalidInput


def pose(frame: int, measured: bool = True) -> str:
    return json.dumps({"type": "pose", "frame_id": frame, "measured": measured})


def test_rate_latency_and_what_was_dropped() -> None:
    stream = Stream(sent_s={0: 0.0, 1: 0.1, 2: 0.2, 3: 0.3})
    stream.read(pose(0), 0.5)
    stream.read(json.dumps({"type": "found", "frame_id": 0}), 0.5)
    assert not stream.over
    stream.read(json.dumps({"type": "dropped", "frames": 2, "first_id": 1, "last_id": 2}), 0.6)
    stream.read(pose(3, measured=False), 1.0)
    assert stream.over
    row = stream.row(224, warm=True)
    assert (row.sent, row.dropped, row.per_s, row.posed) == (4, 2, 2.0, 0.5)
    assert row.p50_ms == pytest.approx((500 + 700) / 2)
    assert row.p99_ms == pytest.approx(700, abs=5)


def test_a_kind_of_one_object_has_nothing_to_follow(recorded: Path) -> None:
    shutil.rmtree(recorded / "egg" / "small")
    with pytest.raises(InvalidInput, match="one teaches it, the other is followed"):
        track.run(lambda memory, grid, warm: pytest.fail("nothing is to be served"), None, grids=[16], rate_hz=15, seconds=1, data=recorded)
