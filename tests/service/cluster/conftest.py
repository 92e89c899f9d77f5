"""A service on a Ray of its own, started once for all tests of a file: that takes ten seconds and more."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest

from clients.simulator.local_service import free_port

ROOT = Path(__file__).parents[3]
START_S = 600
STOP_S = 60


@dataclass
class OnRay:
    """A running one."""

    child: subprocess.Popen[bytes]
    http: httpx.Client
    log: Path

    def processes(self, part: str) -> dict[int, float]:
        """CPU seconds by process of `Encoder`, `PoseSolver` or `MemoryOwner`, of this service alone."""
        found = {}
        for entry in Path("/proc").glob("[0-9]*"):
            with suppress(OSError, ValueError):
                if f"ServeReplica:onelook:{part}".encode() in (entry / "cmdline").read_bytes() and self._own(int(entry.name)):
                    fields = (entry / "stat").read_text().rpartition(")")[2].split()
                    found[int(entry.name)] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
        return found

    def _own(self, pid: int) -> bool:
        while pid > 1 and pid != self.child.pid:
            pid = int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
        return pid == self.child.pid


@contextmanager
def on_ray(memory: Path, log: Path) -> Iterator[OnRay]:
    """A service on that folder."""
    port = free_port()
    command = [sys.executable, str(Path(__file__).with_name("service_on_ray.py")), "ray", str(memory), str(port), "0"]
    with started(command, port, log) as running:
        yield running


@contextmanager
def started(command: list[str], port: int, log: Path) -> Iterator[OnRay]:
    """A service that a command starts on a port, once it answers."""
    environment = {name: value for name, value in os.environ.items() if name != "RAY_ADDRESS"}
    environment |= {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "RAY_SERVE_PROXY_GRACEFUL_SHUTDOWN_TIMEOUT_S": "0.5"}
    with log.open("ab") as output, subprocess.Popen(command, stdout=output, stderr=output, env=environment) as child:
        try:
            with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=60) as http:
                until_ready(http, child, log)
                yield OnRay(child, http, log)
        finally:
            child.send_signal(signal.SIGTERM)
            try:
                child.wait(STOP_S)
            except subprocess.TimeoutExpired:
                child.kill()
                raise


def until_ready(http: httpx.Client, child: subprocess.Popen[bytes], log: Path) -> None:
    """Returns once it answers."""
    deadline = time.monotonic() + START_S
    while time.monotonic() < deadline:
        assert child.poll() is None, log.read_text()[-4000:]
        with suppress(httpx.TransportError):
            if http.get("/readyz", timeout=5).status_code == 200:
                return
        time.sleep(0.1)
    raise AssertionError(f"not ready after {START_S} s: {log.read_text()[-4000:]}")


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[OnRay]:
    """Two encoders, two solvers, an empty memory."""
    folder = tmp_path_factory.mktemp("cluster")
    with on_ray(folder / "memory", folder / "log") as running:
        yield running
