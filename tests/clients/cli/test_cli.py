"""The `onelook` command, against a service where it needs one."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from typer.main import get_command
from typer.testing import CliRunner, Result

import service.app
from clients.answers.observations import Observation
from clients.cli import app
from clients.cli.robot import _facts
from clients.cli.simulate import service as simulated_service
from clients.cli.terminal import console, errors, print_facts, print_table
from clients.datasets import samples as shipped
from clients.datasets.folders import Sequence
from clients.errors import Unreachable
from clients.simulator.local_service import local_service
from core import quality
from core.errors import InvalidInput
from store.memory import Memory

from ..conftest import CentreBackbone


def onelook(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def test_help_names_every_command_without_heavy_imports() -> None:
    check = "import sys, clients.cli; sys.exit(bool({'torch', 'open3d', 'uvicorn', 'transformers', 'jinja2'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", check]).returncode == 0
    page = onelook("--help").output
    assert all(name in page for name in ("serve", "observe", "scan", "categories", "memory", "simulate", "samples", "bench"))
    assert all(name in onelook("bench", "--help").output for name in ("pose", "discovery", "speed", "isolation"))


def test_it_says_the_version_that_is_installed() -> None:
    said = onelook("--version")
    assert (said.exit_code, said.output) == (0, f"onelook {version('onelook')}\n")


def test_an_object_is_taught_named_recognised_and_forgotten(url: str, recordings: list[Sequence]) -> None:
    folder = recordings[0].path
    assert "outcome" in onelook("observe", folder, "--views", 2, "--url", url).output
    taught = onelook("scan", folder, "--name", "bug", "--url", url)
    assert taught.exit_code == 0, taught.output
    assert "learnt bug" in taught.output
    listed = json.loads(onelook("categories", "list", "--json", "--url", url).output)
    assert [each["name"] for each in listed] == ["bug"]
    assert "bug" in onelook("categories", "--url", url).output
    seen = json.loads(onelook("observe", folder, "--json", "--url", url).output)
    assert (seen["outcome"], seen["name"]) == ("known", "bug")
    assert onelook("observe", folder, "--no-learn", "--url", url).exit_code == 0
    (joined,) = json.loads(onelook("categories", "list", "--json", "--url", url).output)
    assert joined["instances"] == listed[0]["instances"] + 1
    assert "correspondences" in onelook("observe", folder, "--category", "bug", "--url", url).output
    assert onelook("categories", "rename", "bug", "beetle", "--url", url).exit_code == 0
    assert json.loads(onelook("memory", "--json", "--url", url).output)["categories"] == 1
    assert onelook("categories", "forget", listed[0]["id"][:8], "--url", url).exit_code == 0
    assert "empty" in onelook("categories", "list", "--url", url).output


def test_answers_in_other_formats(url: str, recordings: list[Sequence]) -> None:
    folder = recordings[0].path
    assert onelook("observe", folder, "--views", 2, "--format", "bop", "--url", url).output == "scene_id,im_id,obj_id,score,R,t,time\n"
    onelook("scan", folder, "--views", 3, "--url", url)
    header, *lines = onelook("observe", folder, "--views", 3, "--format", "bop", "--url", url).output.splitlines()
    assert header.startswith("scene_id,im_id,obj_id")
    assert len(lines) == 3
    assert {tuple(line.split(",")[i] for i in (0, 2)) for line in lines} == {("0", "1")}
    message = json.loads(onelook("observe", folder, "--views", 3, "--format", "vision_msgs", "--url", url).output)
    assert len(message["detections"]) == 1


def test_a_scan_says_what_is_wrong_with_a_view(url: str, recordings: list[Sequence], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(quality, "LEAST_SHARPNESS", 1e9)
    taught = onelook("scan", recordings[0].path, "--views", 2, "--json", "--url", url)
    assert json.loads(taught.stdout)["views"] == 2
    assert re.search(r"^view 0: its sharpness is .*hold still", taught.stderr, re.MULTILINE)


def test_photographs_ask_what_an_object_is(url: str, recordings: list[Sequence]) -> None:
    seen = json.loads(onelook("observe", f"images:{recordings[0].path / 'rgb'}", "--views", 3, "--json", "--url", url).output)
    assert (seen["outcome"], seen["views"], seen["scan"]) == ("novel", 3, None)


def test_without_a_service_the_memory_is_opened_here(recordings: list[Sequence], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(service.app, "load_backbone", lambda name, device, report: CentreBackbone())
    monkeypatch.setenv("ONELOOK_DATA_DIR", str(tmp_path / "memory"))
    monkeypatch.setenv("ONELOOK_THRESHOLD", "0.9999")
    taught = onelook("scan", recordings[0].path, "--local", "--views", 2, "--name", "bug")
    assert taught.exit_code == 0, taught.output
    assert json.loads(onelook("observe", recordings[0].path, "--local", "--views", 2, "--json").stdout)["name"] == "bug"
    with Memory.open(tmp_path / "memory"):
        taken = onelook("observe", recordings[0].path, "--local")
    assert taken.exit_code == 1
    assert "open in another process" in taken.output


WITHOUT_JSON = {"onelook serve"}
"""It serves, and answers nothing."""


def test_every_command_has_json() -> None:
    def leaves(command: Any, name: str) -> Iterator[tuple[str, set[str]]]:
        inner = getattr(command, "commands", None)
        if inner is None:
            yield name, {option for parameter in command.params for option in parameter.opts}
            return
        for child, below in inner.items():
            yield from leaves(below, f"{name} {child}")

    lacking = {name for name, options in leaves(get_command(app), "onelook") if "--json" not in options}
    assert lacking <= WITHOUT_JSON


def test_every_option_says_what_it_is_for() -> None:
    def silent(command: Any, name: str) -> Iterator[str]:
        yield from (f"{name} {each.name}" for each in command.params if each.name != "help" and not each.help)
        for child, below in getattr(command, "commands", {}).items():
            yield from silent(below, f"{name} {child}")

    assert list(silent(get_command(app), "onelook")) == []


@pytest.mark.parametrize(
    "command", ["render --out o", "simulate", "rearrange", "samples --data d --out o", "bench pose --data d", "bench rendering"]
)
def test_no_seed_is_negative(command: str) -> None:
    refused = onelook(*command.split(), "--seed", -1)
    assert refused.exit_code == 2
    assert "--seed" in refused.output


def test_the_demo_writes_its_report(url: str, recordings: list[Sequence], tmp_path: Path) -> None:
    done = onelook("simulate", "--url", url, "--data", recordings[0].path.parent, "--out", tmp_path / "demo", "--views", 3)
    assert done.exit_code == 0, done.output
    assert "false novel" in done.output
    assert (tmp_path / "demo" / "report.html").stat().st_size > 10_000
    assert json.loads((tmp_path / "demo" / "episode.json").read_text())["summary"]["objects"] == 3


def test_photographs_become_a_folder_in_the_data_layout(recordings: list[Sequence], tmp_path: Path) -> None:
    source = f"images:{recordings[0].path / 'rgb'}"
    written = json.loads(onelook("convert", source, tmp_path / "out", "--json").output)
    assert written == [str(tmp_path / "out" / recordings[0].path.name / "rgb")]
    assert "not empty" in onelook("convert", source, tmp_path / "out").output


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["convert", "kitti:nowhere", "out"], "'kitti' in 'kitti:nowhere' is none of bop, co3d"),
        (["categories", "list", "--url", "http://127.0.0.1:9"], "onelook serve"),
        (["observe", "nowhere"], "nowhere is no folder"),
    ],
)
def test_errors_are_one_sentence_with_the_remedy(words: list[str], says: str) -> None:
    failed = onelook(*words)
    assert failed.exit_code == 1
    assert failed.output.startswith("error: ")
    assert says in failed.output
    assert "Traceback" not in failed.output


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["categories", "--url", "http://127.0.0.1:9", "forget", "mug"], "--url: goes behind forget"),
        (["memory", "--json", "info"], "--json: goes behind info"),
    ],
)
def test_an_option_before_its_subcommand_is_refused(words: list[str], says: str) -> None:
    """It would be ignored, and a category forgotten by another service than the one that was named."""
    refused = onelook(*words)
    assert refused.exit_code == 1
    assert says in refused.stderr


def test_a_file_where_a_folder_is_to_be_made_is_named(tmp_path: Path) -> None:
    taken = tmp_path / "taken"
    taken.touch()
    for words in (["render", "--category", "mug", "--out", taken], ["simulate", "--out", taken / "run"], ["rearrange", "--out", taken]):
        said = onelook(*words)
        assert said.exit_code == 1
        assert said.stderr.startswith(f"error: {taken}")


def test_a_folder_of_many_objects_and_an_unknown_category_are_refused(url: str, recordings: list[Sequence]) -> None:
    assert "holds 3 objects; name one" in onelook("observe", recordings[0].path.parent).output
    assert "no category is called 'cup'" in onelook("categories", "forget", "cup", "--url", url).output


def test_missing_samples_are_said_to_be_missing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(shipped, "SAMPLES", tmp_path / "none")
    failed = onelook("simulate", "--world", "replay", "--out", tmp_path / "out")
    assert failed.exit_code == 1
    assert "--data" in failed.output


def test_a_script_of_what_is_not_there_costs_no_former_run_its_memory(tmp_path: Path) -> None:
    learnt = tmp_path / "memory" / "learnt"
    learnt.parent.mkdir()
    learnt.touch()
    (tmp_path / "script.yaml").write_text("categories: [unicorn]")
    assert "'unicorn' is none of" in onelook("simulate", tmp_path / "script.yaml", "--out", tmp_path).output
    assert learnt.exists()


def test_a_service_that_cannot_start_shows_its_log(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("ONELOOK_PORT", "8000")
    monkeypatch.setenv("ONELOOK_MAX_VIEWS", "many")
    with pytest.raises(Unreachable, match="(?s)stopped; its log .*ONELOOK_MAX_VIEWS"), local_service(tmp_path / "memory", tmp_path / "log"):
        pass


def test_nothing_spins_on_where_a_service_does_not_start(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    ended: list[str] = []

    @contextmanager
    def status(text: str) -> Iterator[Any]:
        try:
            yield SimpleNamespace(stop=lambda: None)
        finally:
            ended.append(text)

    @contextmanager
    def refused(memory: Path, log: Path) -> Iterator[str]:
        raise Unreachable("the service stopped")
        yield

    monkeypatch.setattr(errors, "status", status)
    monkeypatch.setattr("clients.simulator.local_service.local_service", refused)
    monkeypatch.setattr("core.backbones.weights.embedded_weights", lambda report: None)
    with pytest.raises(Unreachable), simulated_service(None, tmp_path):
        pass
    assert ended == ["looking for the backbone's weights", "starting the service"]


def test_brackets_of_an_error_are_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(text: str) -> None:
        raise InvalidInput("views[3].depth", "install 'onelook[server]'")

    monkeypatch.setattr("clients.datasets.sources.find_sequences", refuse)
    assert onelook("observe", "x").output == "error: views[3].depth: install 'onelook[server]'\n"


def test_names_are_printed_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    name = "[mug] :car: [/b]"
    print_table([{"name": name}], "none")
    print_facts({"category": name})
    console.print(f"forgot {name}")
    errors.print(f"a key for {name}")
    printed = capsys.readouterr()
    assert (printed.out.count(name), printed.err.count(name)) == (3, 1)


def test_an_uncertain_answer_says_where_to_look_next() -> None:
    pose = np.eye(4)
    pose[:3, 3] = [0.5, -0.25, 1]
    seen = SimpleNamespace(
        **dict.fromkeys(("category_id", "name", "probability", "pose", "scan", "pose_error", "scan_error")),
        outcome="uncertain",
        similarities=(),
        candidates=("cup", "bowl"),
        viewpoints=pose[None],
        id="o",
        timings_ms={"total": 7.0},
        raw={"grounds": None},
    )
    facts = _facts(seen)
    assert facts["candidates"] == "cup, bowl"
    assert facts["look from"] == "0.50, -0.25, 1.00 m, in the burst's world frame, next"
    assert not {"faults", "weakness", "confidence"} & set(facts)


def test_a_doubtful_pose_does_not_look_like_a_good_one(url: str, recordings: list[Sequence], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(quality, "LEAST_SHARPNESS", 1e9)
    folder = recordings[0].path
    onelook("scan", folder, "--views", 3, "--name", "bug", "--url", url)
    asked = ("observe", folder, "--category", "bug", "--views", 1, "--no-learn", "--url", url)
    said, seen = onelook(*asked).output, json.loads(onelook(*asked, "--json").output)
    assert "blur in 1 of 1 views" in said
    assert "it rests on one view" in said
    doubtful = Observation.from_json({**seen, "pose": {**seen["pose"], "confidence": 0.1}})
    assert _facts(doubtful)["confidence"] == "0.10 that the rotation is within 30°"
