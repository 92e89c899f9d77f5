"""The demo episode: a simulated robot in a process of its own, which talks to this service as every robot does."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import threading
from dataclasses import dataclass
from pathlib import Path

from core.errors import Conflict
from store.keys import Keys
from store.memory import Memory

OBJECTS = 15
"""That the robot meets, as many as in `make demo`."""
LIMIT_S = 1800.0
"""Then it is stopped, whatever it does."""
STOP_S = 5.0
KEY_NAME = "demo episode"
ROOT = Path(__file__).resolve().parents[2]
SCRIPT = f"world: raycast\nlength: {OBJECTS}\n"
REPORT_LINES = 3
"""Of its log, where it failed."""


@dataclass(frozen=True)
class DemoState:
    """How far it is."""

    running: bool
    met: int
    """Objects that the robot is done with."""
    failure: str | None
    """How it ended, where that was not well."""
    begun: bool
    """Whether there ever was one, since the service started."""


class Demo:
    """At most one episode at a time, and none outlives the service."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._limit: threading.Timer | None = None
        self._stopped = False

    def start(self, memory: Memory, address: str, *, actor: str | None = None) -> None:
        """Begins one against the service at `address`, whose memory this is.

        Raises Conflict while one runs, and for a memory that is not empty: the robot's toys do not belong among what was learnt.
        """
        with self._lock:
            if self._running:
                raise Conflict("a demo episode runs already; stop it first")
            if memory.categories.all():
                raise Conflict(
                    "the memory is not empty, and the demo's toys do not belong among what was learnt: start another service with "
                    "`onelook serve --data-dir NEW_FOLDER --port 8001`, or run `onelook simulate`, which starts one of its own"
                )
            self._clean()
            self._folder = tempfile.TemporaryDirectory(prefix="onelook-demo-")
            folder = Path(self._folder.name)
            (folder / "script.yaml").write_text(SCRIPT)
            arguments = ["simulate", str(folder / "script.yaml"), "--url", address, "--out", str(folder)]
            with (folder / "log").open("wb") as log:
                self._process = subprocess.Popen(
                    [sys.executable, "-m", "clients.cli", *arguments],  # by its name: the service imports nothing of a robot
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    env=_environment(_key(memory.keys, actor)),
                    start_new_session=True,  # so that nothing it starts is left over
                )
            self._stopped = False
            self._limit = threading.Timer(LIMIT_S, self.stop)
            self._limit.daemon = True
            self._limit.start()

    def stop(self) -> None:
        """Ends it, where one runs."""
        with self._lock:
            if self._process is None or not self._running:
                return
            self._stopped = True
            os.killpg(self._process.pid, signal.SIGTERM)
            try:
                self._process.wait(STOP_S)
            except subprocess.TimeoutExpired:
                os.killpg(self._process.pid, signal.SIGKILL)
                self._process.wait()

    def close(self) -> None:
        """Ends it and forgets it: the service stops."""
        self.stop()
        with self._lock:
            self._clean()

    def state(self) -> DemoState:
        """As it is now."""
        with self._lock:
            if self._process is None or self._folder is None:
                return DemoState(False, 0, None, False)
            folder = Path(self._folder.name)
            lines = folder / "episode.jsonl"
            met = max(0, lines.read_bytes().count(b"\n") - 1) if lines.is_file() else 0  # the first says how it was started
            return DemoState(self._running, met, self._failure(folder), True)

    @property
    def _running(self) -> bool:
        return self._process is not None and self._process.poll() is None

    def _failure(self, folder: Path) -> str | None:
        assert self._process is not None
        if self._running or self._process.returncode == 0:
            return None
        if self._stopped:
            return "it was stopped"
        said = (folder / "log").read_text(errors="replace").strip().splitlines()
        return " ".join(line.strip() for line in said[-REPORT_LINES:]) or f"it ended with {self._process.returncode}"

    def _clean(self) -> None:
        if self._limit is not None:
            self._limit.cancel()
        if self._folder is not None:
            self._folder.cleanup()
        self._process = self._folder = self._limit = None


def _key(keys: Keys, actor: str | None) -> str | None:
    """A robot's key for the episode, where the service asks for keys; the one of an earlier episode is revoked."""
    if not keys.required():
        return None
    for key in keys.all():
        if key.name == KEY_NAME:
            keys.revoke(key.id, actor=actor)
    return keys.create(KEY_NAME, "robot", actor=actor)[1]


def _environment(key: str | None) -> dict[str, str]:
    """This process's without the service's settings, with this package to be found from any folder."""
    inherited = {name: value for name, value in os.environ.items() if not name.startswith("ONELOOK_") or name == "ONELOOK_CACHE"}
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    return inherited | {"PYTHONPATH": path} | ({"ONELOOK_API_KEY": key} if key else {})
