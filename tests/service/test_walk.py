"""docs/architecture.md tells the truth: every name on it exists, and a burst comes through the rooms in its order."""

from __future__ import annotations

import importlib
import inspect
import re
import threading
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import pytest
from fastapi.testclient import TestClient

from service.app import create_app
from service.settings import Settings

PAGE = (Path(__file__).parents[2] / "docs" / "architecture.md").read_text()
NAMES = sorted(set(re.findall(r"`((?:core|store|service|clients|benchmarks)(?:\.\w+)+)`", PAGE)))
WALK = re.findall(r"^\d+\. `([\w.]+)`", PAGE, re.MULTILINE)


def named(name: str) -> Any:
    """What a dotted name stands for: modules as far as there are any, then attributes."""
    found, parts = importlib.import_module(name.partition(".")[0]), name.split(".")[1:]
    for index, part in enumerate(parts):
        if not hasattr(found, part):
            importlib.import_module(".".join([name.partition(".")[0], *parts[: index + 1]]))
        found = getattr(found, part)
    return found


@pytest.mark.parametrize("name", NAMES)
def test_every_name_of_the_page_exists(name: str) -> None:
    assert named(name)


class Walk:
    """The functions of a walk, in the order in which they were first called, in any thread that began meanwhile."""

    def __init__(self, names: list[str]) -> None:
        self._codes: dict[CodeType, str] = {inspect.unwrap(named(name)).__code__: name for name in names}
        self.came: dict[str, int] = {}
        self.on = threading.Event()

    def __call__(self, frame: FrameType, event: str, argument: object) -> None:
        """See `threading.setprofile`."""
        if event == "call" and self.on.is_set() and (name := self._codes.get(frame.f_code)):
            self.came[name] = self.came.get(name, 0) + 1


def test_a_burst_comes_through_the_rooms_in_the_order_of_the_page(backbone: Any, look: Any, parts: Any, tmp_path: Path) -> None:
    walk = Walk(WALK)
    threading.setprofile(walk)
    try:
        with TestClient(create_app(Settings(data_dir=tmp_path / "memory"), backbone=backbone)) as client:
            scan = client.post("/v1/scans", files=parts(look())).json()
            client.post(f"/v1/scans/{scan['id']}/views", files=parts(look()))
            client.post(f"/v1/scans/{scan['id']}/complete")
            walk.on.set()
            seen = client.post("/v1/observations", files=parts(look(views=4))).json()
            walk.on.clear()
    finally:
        threading.setprofile(None)
    assert (seen["outcome"], seen["verified"]) == ("known", True)
    assert list(walk.came) == WALK
    once = {name: times for name, times in walk.came.items() if name in ONCE}
    assert once == dict.fromkeys(ONCE, 1)


ONCE = (
    "service.agent.Agent.observe",
    "core.encode.Encoder.encode",
    "core.view_consistency.consistent_only",
    "core.novelty.decide",
    "store.observations.Observations.create",
)
"""What is dear, or changes the memory."""
