"""Draws docs/load.png: a service whose backbone sleeps in the place of working, asked by ever more robots.

    PYTHONPATH=. python tests/benchmarks/load_of_a_slow_service.py docs/load.png

What is measured is the queue before the work, and not this machine.
"""

from __future__ import annotations

import subprocess
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType

import numpy as np

from benchmarks import load
from core.sim3 import Sim3

TESTS = Path(__file__).parents[1]
PASS_S, GRACE_S = "0.3", "1"
SECONDS = 10
VIEWS = 3


def module(path: Path, name: str) -> ModuleType:
    """A file of the tests."""
    spec = spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    made = sys.modules[name] = module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


def main(picture: Path) -> None:
    """Draws it, and prints the table."""
    world, recording = module(TESTS / "conftest.py", "world"), module(TESTS / "benchmarks" / "conftest.py", "recording")
    with TemporaryDirectory() as scratch:
        folder = Path(scratch)
        egg = world.Ellipsoid(recording.HALF_AXES)
        for name, world_from_model in (("large", Sim3(0.5, np.eye(3), np.zeros(3))), ("small", Sim3(0.3, np.eye(3), np.ones(3)))):
            recording.record(folder / "data" / "egg" / name, egg, world_from_model)
        command = [sys.executable, str(TESTS / "service" / "slow_service.py"), str(folder / "memory"), PASS_S, GRACE_S]
        with (
            (folder / "log").open("w") as log,
            subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True) as service,
        ):
            try:
                assert service.stdout is not None
                url = service.stdout.readline().strip()
                load.run(None, picture, seconds=SECONDS, views=VIEWS, data=folder / "data", url=url)
            finally:
                service.kill()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
