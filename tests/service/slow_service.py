"""A service in a process of its own on the synthetic world, each pass of whose backbone takes a while; run by test_stopping.py,
test_hanging.py and the short soak of tests/benchmarks/.

Arguments: the memory's folder, the seconds of a pass, and those that answers get at the end. Prints its address once it has a port. While
there is a file `pass-hangs` beside the memory, a pass does not come back, and beside `disk-hangs` no commit does.
"""

from __future__ import annotations

import logging.config
import socket
import sqlite3
import sys
import time
from functools import partial
from pathlib import Path
from typing import Any
from unittest import mock

from service import server
from service.app import create_app
from service.logs import config
from service.settings import Settings
from tests.conftest import ColourBackbone


def hang(sign: Path) -> None:
    """Comes back once there is no such file."""
    while sign.exists():
        time.sleep(0.01)


def slow_backbone(pass_s: float, sign: Path) -> Any:
    """The synthetic world's, made slow, and hanging while there is that file."""

    class Slow(ColourBackbone):
        def extract(self, images: Any) -> Any:
            time.sleep(pass_s)
            hang(sign)
            return super().extract(images)

    return Slow()


def main(folder: str, pass_s: str, grace_s: str) -> None:
    """Serves until it is told to stop."""
    server.GRACE_S = int(grace_s)
    logging.config.dictConfig(config("json"))
    memory = Path(folder)
    settings = Settings(data_dir=memory, variant="ucd", score="pooled_best_view", queue=4)
    listener = socket.create_server(("127.0.0.1", 0))
    sys.stdout.write(f"http://127.0.0.1:{listener.getsockname()[1]}\n")
    sys.stdout.flush()
    backbone = slow_backbone(float(pass_s), memory.with_name("pass-hangs"))

    class Disk(sqlite3.Connection):
        def execute(self, sql: str, *parameters: Any) -> sqlite3.Cursor:
            if sql == "COMMIT":
                hang(memory.with_name("disk-hangs"))
            return super().execute(sql, *parameters)

    with mock.patch.object(sqlite3, "connect", partial(sqlite3.connect, factory=Disk)):
        server.Server(create_app(settings, backbone=backbone)).run(sockets=[listener])


if __name__ == "__main__":
    main(*sys.argv[1:])
