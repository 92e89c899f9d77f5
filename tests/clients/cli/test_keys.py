"""`onelook keys`: making, listing and revoking."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from clients.cli import app
from store.memory import Memory


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A memory's, which is not there yet."""
    monkeypatch.setenv("ONELOOK_DATA_DIR", str(tmp_path / "memory"))
    return tmp_path / "memory"


def keys(*words: str) -> Result:
    """Runs `onelook keys`."""
    return CliRunner().invoke(app, ["keys", *words])


def test_a_key_is_shown_once_and_alone_on_standard_output(folder: Path) -> None:
    made = keys("create", "arm-2", "--role", "robot")
    assert made.exit_code == 0
    (text,) = made.stdout.splitlines()
    assert "cannot be shown again" in made.stderr
    with Memory.reading(folder) as memory:
        assert memory.keys.find(text).name == "arm-2"
    assert text.split("_", 2)[2] not in keys("list").output + keys("list", "--json").output


def test_keys_are_listed_and_revoked(folder: Path) -> None:
    assert "no keys" in keys("list").stdout
    made = json.loads(keys("create", "arm", "--role", "robot", "--json").stdout)
    (listed,) = json.loads(keys("list", "--json").stdout)
    assert (listed["id"], listed["role"]) == (made["id"], "robot")
    assert "arm" in keys("list").stdout
    assert "revoked" in keys("revoke", made["id"]).stdout
    assert json.loads(keys("list", "--json").stdout) == []


def test_a_role_must_be_chosen_among_those_there_are(folder: Path) -> None:
    assert keys("create", "arm").exit_code == 2
    assert keys("create", "arm", "--role", "root").exit_code == 2


def test_an_unknown_key_is_told_in_a_sentence(folder: Path) -> None:
    refused = keys("revoke", "0")
    assert refused.exit_code == 1
    assert "onelook keys list" in refused.stderr
