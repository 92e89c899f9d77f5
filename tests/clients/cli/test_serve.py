"""`onelook serve`: it tells what it waits for, and what keeps it from starting in one sentence with the remedy."""

from __future__ import annotations

import json
import logging
import socket
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
import uvicorn
from numpy.typing import NDArray
from typer.testing import CliRunner, Result

import service.app
import service.settings
from clients.cli import app
from clients.cli.service import bound
from core.errors import Unavailable
from store.memory import Memory


class Loaded:
    """A backbone as far as a start needs one."""

    name, fingerprint, patch_size = "centre", "centre-1", 14
    passes: ClassVar[list[tuple[int, ...]]] = []

    def extract(self, images: NDArray[np.uint8]) -> None:
        """Notes that it was used."""
        self.passes.append(images.shape)


@pytest.fixture(autouse=True)
def loading(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A backbone that is there at once, no server, and the loggers as they were."""
    monkeypatch.setattr(service.app, "load_backbone", lambda name, device, report: Loaded())
    monkeypatch.setattr(uvicorn.Server, "run", lambda server, sockets: None)
    monkeypatch.setattr(Loaded, "passes", [])
    yield
    for name in ("onelook", "uvicorn"):
        logging.getLogger(name).handlers.clear()


@pytest.fixture
def serve(tmp_path: Path) -> Callable[..., Result]:
    """serve(*options): `onelook serve` on a free port with a memory in a temporary folder."""

    def run(*options: object) -> Result:
        words = ["serve", "--port", 0, "--data-dir", tmp_path / "memory", *options]
        return CliRunner().invoke(app, [str(word) for word in words])

    return run


def refused(result: Result, *words: str) -> None:
    """Asserts one sentence on stderr that has all `words`."""
    assert result.exit_code == 1, result.output
    (sentence,) = [line for line in result.stderr.splitlines() if " INFO " not in line]
    assert sentence.startswith("error: ")
    for word in words:
        assert word in sentence


def test_it_says_where_it_serves(serve: Callable[..., Result], tmp_path: Path) -> None:
    started = serve()
    assert started.exit_code == 0, started.output
    assert "serving on http://127.0.0.1:" in started.stderr
    assert str(tmp_path / "memory") in started.stderr


def test_it_says_what_takes_long_before_it_begins(serve: Callable[..., Result], monkeypatch: pytest.MonkeyPatch) -> None:
    def load(name: str, device: str, report: Callable[[str], None]) -> Loaded:
        report("begun")
        return Loaded()

    monkeypatch.setattr(service.app, "load_backbone", load)
    said = serve().stderr
    assert 0 < said.index("loading the backbone dinov2-s14") < said.index("begun")


def test_an_address_of_ipv6_is_in_brackets(serve: Callable[..., Result], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("clients.cli.service.bound", lambda host, port: bound("127.0.0.1", port))  # which every machine has
    assert "serving on http://[::1]:" in serve("--host", "::1").stderr


def test_it_listens_only_once_it_is_warm(serve: Callable[..., Result], monkeypatch: pytest.MonkeyPatch) -> None:
    before_it_listened: list[tuple[int, ...]] = []
    monkeypatch.setattr(uvicorn.Server, "run", lambda server, sockets: before_it_listened.extend(Loaded.passes))
    assert "warmed up" in serve().stderr
    assert before_it_listened == [(1, 392, 392, 3)]


def test_the_log_is_json_where_it_is_asked_for(serve: Callable[..., Result], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ONELOOK_LOG", "json")
    assert [json.loads(line)["message"].split()[0] for line in serve().stderr.splitlines()] == ["loading", "warmed", "serving"]
    monkeypatch.setenv("ONELOOK_LOG", "xml")
    refused(serve(), "ONELOOK_LOG", "'xml'")


def test_the_first_start_tells_of_the_download(serve: Callable[..., Result], monkeypatch: pytest.MonkeyPatch) -> None:
    def fetch(name: str, device: str, report: Callable[[str], None]) -> None:
        report("fetching the weights (90 MB)")
        raise Unavailable("could not fetch the weights; check the network")

    monkeypatch.setattr(service.app, "load_backbone", fetch)
    failed = serve()
    assert "fetching the weights (90 MB)" in failed.stderr
    refused(failed, "check the network")


def test_a_memory_of_another_backbone(serve: Callable[..., Result], tmp_path: Path) -> None:
    with Memory.open(tmp_path / "memory") as memory:
        memory.require_backbone("other", "other-1")
    refused(serve(), "other-1", "centre-1", "ONELOOK_BACKBONE", "ONELOOK_DATA_DIR")


def test_a_memory_that_another_process_has_open(serve: Callable[..., Result], tmp_path: Path) -> None:
    with Memory.open(tmp_path / "memory"):
        refused(serve(), "open in another process", "ONELOOK_DATA_DIR")


def test_a_memory_that_cannot_be_written(serve: Callable[..., Result], tmp_path: Path) -> None:
    (tmp_path / "memory").write_text("a file, not a folder")
    refused(serve(), "cannot open the memory", "ONELOOK_DATA_DIR")


def test_every_setting_is_in_the_help(serve: Callable[..., Result]) -> None:
    shown = serve("--help").output
    for name in service.settings.Settings.model_fields:
        assert f"ONELOOK_{name.upper()}" in shown


def test_an_address_that_others_reach_takes_a_key(serve: Callable[..., Result], tmp_path: Path) -> None:
    refused(serve("--host", "0.0.0.0"), "ONELOOK_HOST", "nobody has a key", "onelook keys create")
    with Memory.keyring(tmp_path / "memory") as keys:
        key, _ = keys.create("arm", "robot")
    assert serve("--host", "0.0.0.0").exit_code == 0
    with Memory.keyring(tmp_path / "memory") as keys:
        keys.revoke(key.id)
    refused(serve("--host", "0.0.0.0"), "nobody has a key")


def test_wrong_settings_are_told_before_a_backbone_is_loaded(serve: Callable[..., Result], monkeypatch: pytest.MonkeyPatch) -> None:
    def load(name: str, device: str, report: Callable[[str], None]) -> None:
        raise AssertionError("loaded")

    monkeypatch.setattr(service.app, "load_backbone", load)
    for variable, value in (("VARIANT", "nonsense"), ("SCORE", "nonsense"), ("SCAN_VIEWS", "64")):
        with monkeypatch.context() as environment:
            environment.setenv(f"ONELOOK_{variable}", value)
            refused(serve(), value)


def test_a_used_port(serve: Callable[..., Result]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        refused(serve("--port", port), f"port {port}", "--port", "0 takes a free one")


def test_a_wrong_setting(serve: Callable[..., Result], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ONELOOK_MAX_VIEWS", "many")
    refused(serve(), "ONELOOK_MAX_VIEWS", "'many'")
    refused(serve("--port", 70_000), "--port", "70000")


def test_a_cluster_takes_libraries_of_its_own(serve: Callable[..., Result], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    refused(serve("--cluster"), "needs ray", "onelook[server,cluster]")
