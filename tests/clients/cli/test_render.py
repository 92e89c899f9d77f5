"""`onelook render`, with a mesh of a user's own."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from clients.cli import app
from clients.datasets.folders import find_sequences


def test_meshes_become_recordings_and_a_contact_sheet(tmp_path: Path) -> None:
    folder = tmp_path / "meshes" / "wedge"
    folder.mkdir(parents=True)
    (folder / "one.obj").write_text("v 0 0 0\nv 0.2 0 0\nv 0 0.2 0\nv 0 0 0.2\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    out = tmp_path / "out"
    done = CliRunner().invoke(app, ["render", "--meshes", str(tmp_path / "meshes"), "--out", str(out), "--views", "1", "--json"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout[done.stdout.index("[") :]) == [str(out / "wedge" / "one")]
    assert (out / "contact-sheet.jpg").is_file()
    (sequence,) = find_sequences(out)
    assert sequence.world_from_model is not None
    assert sequence.world_from_model.scale == pytest.approx(0.2 * 3**0.5)


def test_categories_are_the_simulators_own(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["render", "--meshes", str(tmp_path), "--category", "mug", "--out", str(tmp_path / "out")])
    assert done.exit_code == 1
    assert "--category: is of the simulator's own objects" in done.output


def test_an_unknown_category_is_one_sentence(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["render", "--category", "unicorn", "--out", str(tmp_path / "out")])
    assert done.exit_code == 1
    assert "'unicorn' is none of aeroplane" in done.output
