"""A service that is told to stop, as a process and by SIGTERM: what it works on is finished, and nothing acknowledged is lost."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.service.conftest import until

ROOT = Path(__file__).parents[2]
PASS_S = 0.4
"""Encoding a burst takes two passes."""


@dataclass
class Process:
    """A running service."""

    child: subprocess.Popen[str]
    http: httpx.Client

    def until(self, name: str, value: float) -> None:
        """Returns once a figure is that."""
        until(lambda: f"\n{name} {value}\n" in self.http.get("/metrics").text)

    def stop(self) -> list[dict[str, Any]]:
        """SIGTERM; the lines of the log, once it has ended as it was told to."""
        self.child.send_signal(signal.SIGTERM)
        _, log = self.child.communicate(timeout=30)
        assert self.child.returncode == -signal.SIGTERM  # not killed: it ends, and then as whoever told it expects
        return [json.loads(line) for line in log.splitlines()]


@contextmanager
def served(memory: Path, pass_s: float = PASS_S, grace_s: int = 30, **settings: object) -> Iterator[Process]:
    """A service on that folder, with one worker unless the settings say otherwise."""
    command = [sys.executable, str(Path(__file__).with_name("slow_service.py")), str(memory), str(pass_s), str(grace_s)]
    given = {f"ONELOOK_{name.upper()}": str(value) for name, value in ({"workers": 1} | settings).items()}
    environment = os.environ | given | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment) as child:
        try:
            address = child.stdout.readline().strip()
            with httpx.Client(base_url=address, timeout=30) as http:
                while http.get("/readyz").status_code != 200:
                    time.sleep(0.02)
                yield Process(child, http)
        finally:
            child.kill()


def asked(results: dict[str, Any], name: str, ask: Any) -> threading.Thread:
    """A thread that keeps the answer, or the reason why there is none, under a name."""

    def run() -> None:
        try:
            results[name] = ask()
        except httpx.TransportError as error:
            results[name] = error

    thread = threading.Thread(target=run)
    thread.start()
    return thread


@pytest.fixture
def files(look: Any, parts: Any) -> Any:
    return parts(look())


def begin(service: Process, files: Any) -> str:
    """A scan with views."""
    scan_id = service.http.post("/v1/scans", files=files).json()["id"]
    assert service.http.post(f"/v1/scans/{scan_id}/views", files=files).status_code == 200
    return scan_id


def test_a_scan_under_way_is_finished_one_that_waits_goes_on_later(tmp_path: Path, files: Any) -> None:
    results: dict[str, Any] = {}
    with served(tmp_path / "memory") as service:
        first, second = begin(service, files), begin(service, files)
        with httpx.Client(base_url=service.http.base_url, timeout=30) as other, httpx.Client(base_url=service.http.base_url) as listener:
            threads = [asked(results, "events", lambda: listener.get("/v1/events", timeout=30).status_code)]
            threads.append(asked(results, "first", lambda: service.http.post(f"/v1/scans/{first}/complete", json={"name": "cup"})))
            with httpx.Client(base_url=service.http.base_url) as watching:
                Process(service.child, watching).until("onelook_work_running", 1.0)
                threads.append(asked(results, "second", lambda: other.post(f"/v1/scans/{second}/complete")))
                Process(service.child, watching).until("onelook_work_waiting", 1.0)
            log = service.stop()
            for thread in threads:
                thread.join()
    assert (results["first"].status_code, results["first"].json()["name"]) == (201, "cup")
    assert (results["second"].status_code, "stopping" in results["second"].json()["detail"]) == (503, True)
    assert int(results["second"].headers["retry-after"]) > 0
    assert results["events"] == 200  # ended, though nothing happens for hours
    assert [line["level"] for line in log if line["level"] in ("ERROR", "WARNING")] == []
    with served(tmp_path / "memory", 0) as again:
        assert [each["name"] for each in again.http.get("/v1/categories").json()["categories"]] == ["cup"]
        scan = again.http.get(f"/v1/scans/{second}").json()
        assert (scan["state"], len(scan["received"])) == ("collecting", 6)
        assert again.http.post(f"/v1/scans/{second}/complete").status_code == 201


def test_work_that_takes_longer_than_answers_get_is_finished_and_answered(tmp_path: Path, files: Any) -> None:
    results: dict[str, Any] = {}
    with served(tmp_path / "memory", pass_s=1.2, grace_s=1) as service:
        scan_id = begin(service, files)
        with httpx.Client(base_url=service.http.base_url) as watching:
            thread = asked(results, "slow", lambda: service.http.post(f"/v1/scans/{scan_id}/complete", json={"name": "cup"}))
            Process(service.child, watching).until("onelook_work_running", 1.0)
        service.stop()
        thread.join()
    assert (results["slow"].status_code, results["slow"].json()["name"]) == (201, "cup")
