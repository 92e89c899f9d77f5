"""A service in a process of its own on the synthetic world, each pass of whose backbone takes a while; run by test_stopping.py.

Arguments: the memory's folder, the seconds of a pass, and those that answers get at the end. Prints its address once it has a port.
"""

from __future__ import annotations

import logging.config
import socket
import sys
import time
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

from service import server
from service.app import create_app
from service.logs import config
from service.settings import Settings

HERE = Path(__file__)


def slow_backbone(pass_s: float) -> Any:
    """The synthetic world's, made slow."""
    spec = spec_from_file_location("world", HERE.parents[1] / "conftest.py")
    assert spec is not None
    assert spec.loader is not None
    world = module_from_spec(spec)
    sys.modules["world"] = world
    spec.loader.exec_module(world)

    class Slow(world.ColourBackbone):  # type: ignore[name-defined, misc]
        def extract(self, images: Any) -> Any:
            time.sleep(pass_s)
            return super().extract(images)

    return Slow()


def main(folder: str, pass_s: str, grace_s: str) -> None:
    """Serves until it is told to stop."""
    server.GRACE_S = int(grace_s)
    logging.config.dictConfig(config("json"))
    settings = Settings(data_dir=Path(folder), variant="ucd", score="pooled_best_view", workers=1, queue=4)
    listener = socket.create_server(("127.0.0.1", 0))
    sys.stdout.write(f"http://127.0.0.1:{listener.getsockname()[1]}\n")
    sys.stdout.flush()
    server.Server(create_app(settings, backbone=slow_backbone(float(pass_s)))).run(sockets=[listener])


if __name__ == "__main__":
    main(*sys.argv[1:])
