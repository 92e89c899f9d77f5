"""A run's journal: what was done is on disk before more is done, and is read again by the run that goes on."""

from __future__ import annotations

from pathlib import Path

import pytest

from clients.errors import ClientError
from clients.simulator.journal import interrupted, kept

SETTINGS = {"seed": 3, "categories": ("mug", "car")}


def as_line(number: int) -> str:
    return f'{{"number": {number}}}'


def test_an_item_is_written_down_before_the_next_one_begins(tmp_path: Path) -> None:
    file = tmp_path / "run.jsonl"
    seen = [(number, len(interrupted(file, SETTINGS))) for number in kept([1, 2, 3], file, SETTINGS, as_line)]
    assert seen == [(1, 1), (2, 2), (3, 3)]


def test_a_run_that_goes_on_keeps_what_was_done(tmp_path: Path) -> None:
    file = tmp_path / "run.jsonl"
    list(kept([1], file, SETTINGS, as_line))
    assert list(kept([2], file, SETTINGS, as_line, done=[1])) == [2]
    assert interrupted(file, SETTINGS) == [as_line(1), as_line(2)]


def test_half_a_line_is_not_taken_for_an_item(tmp_path: Path) -> None:
    file = tmp_path / "run.jsonl"
    list(kept([1], file, SETTINGS, as_line))
    with file.open("a") as stream:
        stream.write('{"numb')
    assert interrupted(file, SETTINGS) == [as_line(1)]


@pytest.mark.parametrize("settings", [{"seed": 4, "categories": ["mug", "car"]}, {}])
def test_a_run_of_other_settings_is_not_gone_on_with(tmp_path: Path, settings: dict[str, object]) -> None:
    file = tmp_path / "run.jsonl"
    list(kept([1], file, SETTINGS, as_line))
    with pytest.raises(ClientError, match="resume it with the same settings"):
        interrupted(file, settings)


def test_there_must_be_a_run_to_resume(tmp_path: Path) -> None:
    file = tmp_path / "run.jsonl"
    with pytest.raises(ClientError, match="leave out --resume"):
        interrupted(file, SETTINGS)
    file.touch()  # as a run leaves it that is killed before it has written its settings
    with pytest.raises(ClientError, match="leave out --resume"):
        interrupted(file, SETTINGS)
