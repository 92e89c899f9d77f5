"""The `onelook` command, against a service where it needs one."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from clients.cli import app
from clients.datasets import samples as shipped
from clients.datasets.folders import Sequence
from clients.errors import Unreachable
from clients.simulator.local_service import local_service


def onelook(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def test_help_names_every_command_without_heavy_imports() -> None:
    check = "import sys, clients.cli; sys.exit(bool({'torch', 'open3d', 'uvicorn', 'transformers', 'jinja2'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", check]).returncode == 0
    page = onelook("--help").output
    assert all(name in page for name in ("serve", "observe", "scan", "categories", "memory", "simulate", "samples", "bench"))
    assert all(name in onelook("bench", "--help").output for name in ("pose", "discovery", "speed", "isolation"))


def test_an_object_is_taught_named_recognised_and_forgotten(url: str, samples: list[Sequence]) -> None:
    folder = samples[0].path
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


def test_the_demo_writes_its_report(url: str, samples: list[Sequence], tmp_path: Path) -> None:
    done = onelook("simulate", "--url", url, "--data", samples[0].path.parent, "--out", tmp_path / "demo", "--views", 3)
    assert done.exit_code == 0, done.output
    assert "false novel" in done.output
    assert (tmp_path / "demo" / "report.html").stat().st_size > 10_000
    assert json.loads((tmp_path / "demo" / "episode.json").read_text())["summary"]["objects"] == 3


def test_photographs_become_a_folder_in_the_data_layout(samples: list[Sequence], tmp_path: Path) -> None:
    source = f"images:{samples[0].path / 'rgb'}"
    written = json.loads(onelook("convert", source, tmp_path / "out", "--json").output)
    assert written == [str(tmp_path / "out" / samples[0].path.name / "rgb")]
    assert "not empty" in onelook("convert", source, tmp_path / "out").output


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["convert", "kitti:nowhere", "out"], "'kitti' in 'kitti:nowhere' is none of bop, co3d"),
        (["categories", "list", "--url", "http://127.0.0.1:9"], "onelook serve"),
        (["observe", "nowhere"], "no sequence.json below nowhere"),
    ],
)
def test_errors_are_one_sentence_with_the_remedy(words: list[str], says: str) -> None:
    failed = onelook(*words)
    assert failed.exit_code == 1
    assert failed.output.startswith("error: ")
    assert says in failed.output
    assert "Traceback" not in failed.output


def test_a_folder_of_many_objects_and_an_unknown_category_are_refused(url: str, samples: list[Sequence]) -> None:
    assert "holds 3 objects; name one" in onelook("observe", samples[0].path.parent).output
    assert "no category is called 'cup'" in onelook("categories", "forget", "cup", "--url", url).output


def test_missing_samples_are_said_to_be_missing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(shipped, "SAMPLES", tmp_path / "none")
    failed = onelook("simulate")
    assert failed.exit_code == 1
    assert "--data" in failed.output


def test_a_service_that_cannot_start_shows_its_log(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("ONELOOK_PORT", "8000")
    monkeypatch.setenv("ONELOOK_MAX_VIEWS", "many")
    with pytest.raises(Unreachable, match="(?s)stopped; its log .*ONELOOK_MAX_VIEWS"), local_service(tmp_path / "memory", tmp_path / "log"):
        pass
