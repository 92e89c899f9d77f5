"""A service of the simulator's own: a child process on this machine, stopped with the simulator."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import FrameType, MappingProxyType

import httpx

from clients.errors import Unreachable

HOST = "127.0.0.1"
START_S = 300.0
"""A cold start loads torch and the weights from a slow disk, on a machine that may be busy."""
STOP_S = 10.0
POLL_S = 0.2
LOG_LINES = 12


@contextmanager
def local_service(memory: Path, log: Path, settings: Mapping[str, str] = MappingProxyType({})) -> Iterator[str]:
    """The address of a service that keeps its memory in `memory` and writes to `log`; it is stopped on leaving, however that happens.

    `settings` are variables such as ONELOOK_QUEUE, in place of those of this process.

    Raises Unreachable with the end of the log where it does not start.
    """
    address = f"http://{HOST}:{(port := free_port())}"
    command = [sys.executable, "-m", "clients.cli", "serve", "--host", HOST, "--port", str(port), "--data-dir", str(memory)]
    before = signal.signal(signal.SIGTERM, _leave)
    with log.open("w") as output:
        process = subprocess.Popen(
            command, stdout=output, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, env={**_environment(), **settings}
        )
        try:
            _wait(process, address, log)
            yield address
        finally:
            _stop(process)
            signal.signal(signal.SIGTERM, before)


def _environment() -> dict[str, str]:
    """This process's, with this package to be found from any folder."""
    root = str(Path(__file__).resolve().parents[2])
    return os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, [root, os.environ.get("PYTHONPATH")]))}


def _leave(number: int, frame: FrameType | None) -> None:
    """Turns a request to stop into an exception, so that the child is stopped too."""
    raise SystemExit(128 + number)


def free_port() -> int:
    """One of HOST that nobody listens on now."""
    with socket.socket() as probe:
        probe.bind((HOST, 0))
        return int(probe.getsockname()[1])


def becomes_ready(address: str, alive: Callable[[], bool]) -> bool:
    """Waits until a service that was started answers that it is ready; False where its process ends or START_S pass before."""
    deadline = time.monotonic() + START_S
    while time.monotonic() < deadline and alive():
        try:
            if httpx.get(f"{address}/readyz", timeout=2).is_success:
                return True
        except httpx.TransportError:
            pass
        time.sleep(POLL_S)
    return False


def _wait(process: subprocess.Popen[bytes], address: str, log: Path) -> None:
    if becomes_ready(address, lambda: process.poll() is None):
        return
    reason = "stopped" if process.poll() is not None else f"is not ready after {START_S:.0f} s"
    end = "\n".join(log.read_text().splitlines()[-LOG_LINES:])
    raise Unreachable(f"the service {reason}; its log {log} ends with\n{end}")


def _stop(process: subprocess.Popen[bytes]) -> None:
    if process.poll() is None:
        process.terminate()
    try:
        process.wait(STOP_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
