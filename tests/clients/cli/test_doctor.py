"""`onelook doctor`: each fault is named with its remedy."""

from __future__ import annotations

import json
import socket
import sys
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner, Result

import core.backbones
from clients.cli import app, doctor
from clients.cli.doctor import Finding, State
from core.backbones.weights import FOLDER_NAME
from core.errors import Unavailable
from service.settings import Settings
from store.memory import Memory


@pytest.fixture(autouse=True)
def machine(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Weights that are there at once, a memory's folder and a port of its own."""
    monkeypatch.setenv("ONELOOK_DATA_DIR", str(tmp_path / "memory"))
    monkeypatch.setenv("ONELOOK_CACHE", str(tmp_path / "cache"))
    (tmp_path / "cache" / FOLDER_NAME).mkdir(parents=True)
    doctor._backbone_here.cache_clear()
    monkeypatch.setattr(core.backbones, "load_backbone", lambda name: SimpleNamespace(name=name, fingerprint="0123456789abcdef"))
    with socket.create_server(("127.0.0.1", 0)) as taken:
        free = taken.getsockname()[1]
    monkeypatch.setenv("ONELOOK_PORT", str(free))


def run(*words: str) -> Result:
    return CliRunner().invoke(app, ["doctor", *words])


def findings() -> dict[str, Finding]:
    return {finding.what: finding for finding in doctor.examine()}


def test_a_healthy_machine() -> None:
    looked = run()
    assert looked.exit_code == 0, looked.output
    assert "bad" not in looked.output
    written = json.loads(run("--json").stdout)
    assert [each["what"] for each in written] == [
        "python",
        "RAM",
        "libraries",
        "Open3D",
        "device",
        "weights",
        "memory",
        "reach",
        "disk",
        "port",
    ]
    assert {each["state"] for each in written} <= {"good", "poor"}


def test_missing_libraries_stop_the_search_with_the_line_to_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    looked = run()
    assert looked.exit_code == 1
    assert "uvicorn missing" in looked.output
    assert "pip install 'onelook[server]'" in looked.output
    assert "port" not in findings()


def test_a_library_that_is_there_but_does_not_load_is_not_called_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    why = ImportError("libcudart.so.12: cannot open shared object file")
    monkeypatch.setattr(doctor, "_why_not", lambda library: why if library == "torch" else None)
    found = doctor.libraries()
    assert (found.state, found.found) == (State.bad, f"torch does not load: {why}")


def test_open3d_without_its_system_libraries(monkeypatch: pytest.MonkeyPatch) -> None:
    why = OSError("libGL.so.1: cannot open shared object file")
    monkeypatch.setattr(doctor, "_why_not", lambda library: why if library == "open3d" else None)
    found = doctor.open3d()
    assert (found.state, found.found) == (State.bad, str(why))
    assert found.remedy is not None
    assert "apt-get install" in found.remedy
    assert "libgl1" in found.remedy


def test_a_device_that_torch_cannot_use() -> None:
    found = doctor.device(Settings(device="cuda:7"))
    assert found.state is State.bad
    assert "ONELOOK_DEVICE=cpu" in (found.remedy or "")


def test_weights_that_are_still_to_come(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("ONELOOK_CACHE", str(tmp_path / "empty"))
    found = findings()["weights"]
    assert found.state is State.poor
    assert "90 MB" in (found.remedy or "")


def test_weights_that_are_broken(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(name: str) -> None:
        raise Unavailable("model.safetensors is broken; delete the folder")

    monkeypatch.setattr(core.backbones, "load_backbone", broken)
    assert findings()["weights"] == Finding("weights", State.bad, "model.safetensors is broken; delete the folder")


@pytest.mark.parametrize("name", ["other", "dinov2-s14"])
def test_a_memory_of_another_backbone_or_of_other_weights(tmp_path: Path, name: str) -> None:
    with Memory.open(tmp_path / "memory") as memory:
        memory.require_backbone(name, "other-1")
        found = findings()["memory"]  # also while it is open
    assert found.state is State.bad
    assert f"was made with {name} (fingerprint other-1)" in found.found
    assert ("ONELOOK_BACKBONE=other" in (found.remedy or "")) == (name == "other")  # the same name would find the same weights


@pytest.mark.parametrize("name", ["dinov2-s14", "where/it/was/before"])
def test_a_memory_with_something_in_it(tmp_path: Path, name: str) -> None:
    with Memory.open(tmp_path / "memory") as memory:
        memory.require_backbone(name, "0123456789abcdef")
    assert findings()["memory"].found.startswith("0 categories in")


def test_a_folder_that_cannot_be_made(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv("ONELOOK_DATA_DIR", str(tmp_path / "file" / "memory"))
    assert findings()["memory"].state is State.bad


def test_a_used_port(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "PROBE_S", 0.1)
    with socket.create_server(("127.0.0.1", 0)) as other:
        monkeypatch.setenv("ONELOOK_PORT", str(other.getsockname()[1]))
        found = doctor.port(Settings())
    assert found.state is State.bad
    assert "--port" in (found.remedy or "")


def test_an_address_of_ipv6_may_be_taken_too(monkeypatch: pytest.MonkeyPatch) -> None:
    def taken(host: str, port: int) -> socket.socket:
        raise OSError(98, "Address already in use")

    monkeypatch.setattr(doctor, "PROBE_S", 0.1)
    monkeypatch.setattr(doctor, "bound", taken)  # not every machine that tests run on has an address of IPv6
    found = doctor.port(Settings(host="::1", port=9))
    assert (found.state, found.found) == (State.bad, "http://[::1]:9: Address already in use")


def test_what_is_no_name_of_a_host_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "PROBE_S", 0.1)
    found = doctor.port(Settings(host="a..b", port=9))
    assert found.state is State.bad
    assert found.found.startswith("http://a..b:9: ")


def test_the_service_itself_on_its_port(url: str) -> None:
    found = doctor.port(Settings(port=int(url.rpartition(":")[2])))
    assert found.state is State.good
    assert f"OneLook {version('onelook')} answers" in found.found


def test_free_memory_is_told_in_bytes_by_the_thousand(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Path, "read_text", lambda path: "MemTotal: 9 kB\nMemAvailable: 1953125 kB\n")
    assert doctor.working_memory() == Finding("RAM", State.good, "2.0 GB free")


def test_little_memory_and_little_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "LEAST_MEMORY_GB", 1e6)
    monkeypatch.setattr(doctor, "LEAST_DISK_GB", 1e9)
    found = findings()
    assert found["RAM"].state is found["disk"].state is State.poor
    assert run().exit_code == 0  # it works, though not for long


def test_a_wrong_setting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ONELOOK_MAX_VIEWS", "many")
    found = findings()["settings"]
    assert found.state is State.bad
    assert "ONELOOK_MAX_VIEWS" in found.found
    monkeypatch.setenv("ONELOOK_MAX_VIEWS", "32")
    monkeypatch.setenv("ONELOOK_HOST", "0.0.0.0")
    assert "onelook keys create" in findings()["reach"].found
