"""The examples of docs/robot.md, and the commands of docs/quickstart.md, do what the pages say."""

from __future__ import annotations

import asyncio
import json
import re
import shlex
import shutil
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from typer.testing import CliRunner

from clients.cameras.simulated import recorded
from clients.cli import app
from clients.datasets.folders import Sequence, load_burst
from clients.robot import RobotClient

ROOT = Path(__file__).parents[2]
LOOP, ASYNCHRONOUS, STREAMS, ARM = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "robot.md").read_text(), re.DOTALL)
QUICK_START = "".join(re.findall(r"```sh\n(.*?)```", (ROOT / "docs" / "quickstart.md").read_text(), re.DOTALL))
ADDRESS = "http://127.0.0.1:8000"


def run(example: str, url: str) -> dict[str, Any]:
    """The names that an example leaves behind."""
    assert ADDRESS in example
    names: dict[str, Any] = {}
    exec(compile(example.replace(ADDRESS, url), "docs/robot.md", "exec"), names)
    return names


def test_the_quick_starts_commands_teach_a_category(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    monkeypatch.setenv("ONELOOK_URL", url)
    typed = [CliRunner().invoke(app, shlex.split(line)) for line in re.findall(r"^onelook (.*)", QUICK_START, re.MULTILINE)]
    assert [each.exit_code for each in typed] == [0, 0, 0, 0, 0], [each.output for each in typed]
    assert "learnt microwave" in typed[0].output
    assert "microwave" in typed[4].output


@pytest.mark.skipif(shutil.which("curl") is None, reason="needs curl")
def test_the_quick_starts_curl_sends_a_burst(url: str) -> None:
    typed = QUICK_START[QUICK_START.index("CUP=") :].replace(ADDRESS, url)
    ran = subprocess.run(["bash", "-euc", typed], cwd=ROOT, capture_output=True, text=True, check=True)
    assert json.loads(ran.stdout)["outcome"] == "novel"


def test_the_loop_learns_a_category_and_knows_it_then(
    url: str, robot: RobotClient, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)
    assert run(LOOP, url)["category"].name == "cup"
    assert [(each.name, each.views) for each in robot.categories()] == [("cup", 10)]
    robot.observe(load_burst(run(LOOP, url)["cup"], range(4)), category_id=robot.categories()[0].id)  # the same burst joins
    capsys.readouterr()
    assert run(LOOP, url)["seen"].outcome == "known"
    assert "[" in capsys.readouterr().out


def test_the_asynchronous_loop_learns_too(url: str, recordings: list[Sequence]) -> None:
    meet = run(ASYNCHRONOUS, url)["meet"]
    assert asyncio.run(meet(load_burst(recordings[0], range(4)), recorded(recordings[0].path))).name == "cup"


def test_an_object_is_followed_and_events_are_told(
    robot: RobotClient, recordings: list[Sequence], capsys: pytest.CaptureFixture[str]
) -> None:
    names: dict[str, Any] = {}
    exec(compile(STREAMS, "docs/robot.md", "exec"), names)
    (tracked,) = names["follow"](robot, load_burst(recordings[0], [0]).views)
    assert tracked.pose is None  # the memory is empty
    robot.scan(load_burst(recordings[0], range(2)))
    events = robot.events(after=0)
    names["watch"](SimpleNamespace(events=lambda: [next(events)]))
    assert capsys.readouterr().out.startswith("scan_begun {")


def test_the_arms_example_needs_only_a_camera(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("clients.cameras.realsense.RealSense", lambda: "a device")
    names: dict[str, Any] = {}
    exec(compile(ARM, "docs/robot.md", "exec"), names)
    assert names["camera"].device == "a device"
    assert names["camera"].move is names["move"]
