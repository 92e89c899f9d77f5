"""The `onelook` command where libraries are missing: one sentence with the remedy, no traceback."""

from __future__ import annotations

import sys

import pytest
from typer.testing import CliRunner

from clients import command
from clients.cli import app


@pytest.fixture(autouse=True)
def quiet(monkeypatch: pytest.MonkeyPatch) -> None:
    """No log on the stream of a command that has ended."""
    monkeypatch.setattr("logging.config.dictConfig", lambda config: None)


def test_without_the_terminal_libraries(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.startswith("clients.cli")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "typer", None)
    with pytest.raises(SystemExit, match=r"^error: the onelook command needs typer; install it with: pip install 'onelook\[cli\]'$"):
        command.main()


def test_without_the_service(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "service.server", raising=False)  # which other tests may have loaded
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    failed = CliRunner().invoke(app, ["serve"])
    assert failed.exit_code == 1
    assert failed.output.strip() == "error: this command needs uvicorn, which is not installed; run: pip install 'onelook[server]'"


def test_a_missing_part_of_onelook_itself_is_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "service.app", None)
    assert isinstance(CliRunner().invoke(app, ["serve"]).exception, ModuleNotFoundError)
