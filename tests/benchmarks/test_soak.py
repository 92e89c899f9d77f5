"""A short soak of a real process with a fast backbone: hundreds of errands do not make it grow. `make soak` is the long one."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks import soak

ROOT = Path(__file__).parents[2]
MINUTES = 0.75
"""Some 450 errands where two other processes are at work."""
MOST_GROWTH = 0.08
"""Of 500 MB, over the 220 errands between both ends that are compared: 180 kB an errand, less than three of the six images that come with
it; where a busy machine answers half as many, less than all six. Over 4,000 errands the process stays as large as it is, but allocators
reach that size in steps of 10 MB."""


@pytest.fixture
def process(tmp_path: Path) -> Iterator[str]:
    """The address of a service in a process of its own."""
    command = [sys.executable, str(ROOT / "tests" / "service" / "slow_service.py"), str(tmp_path / "memory"), "0", "1"]
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"} | soak.SETTINGS
    with (
        (tmp_path / "log").open("w") as log,
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True, env=environment) as child,
    ):
        try:
            yield child.stdout.readline().strip()
        finally:
            child.kill()


def test_hundreds_of_errands_leave_the_process_as_it_was(process: str, recorded: Path, tmp_path: Path) -> None:
    result = soak.run(
        None,
        tmp_path / "soak.png",
        minutes=MINUTES,
        most_growth=MOST_GROWTH,
        robots=2,
        views=3,
        data=recorded,
        url=process,
        seed=0,
    )
    assert result.answered > 110
    assert result.refused == 0  # two robots for a worker and four places
