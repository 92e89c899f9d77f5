"""Draws docs/scale.png: one process and a cluster, asked by 1, 2, 4 and 8 robots.

    PYTHONPATH=. python tests/service/cluster/side_by_side.py docs/scale.png side_by_side.json

On the left encoders sleep 50 ms an image in the place of working, as if each had a machine of its own; on the right they work, with the
real backbone, on the cores of this machine.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from benchmarks import load
from core.sim3 import Sim3
from tests.benchmarks.conftest import HALF_AXES, record
from tests.conftest import Ellipsoid
from tests.service.cluster.conftest import free_port, started

ROBOTS = (1, 2, 4, 8)
SECONDS = {"sleeping": 20, "working": 12}
VIEWS = 4
IMAGE_S = 0.05
KINDS = {"sleeping": "encoders that sleep", "working": "encoders that work"}


def command(kind: str, cluster: bool, memory: Path, port: int) -> list[str]:
    """What starts a service."""
    if kind == "sleeping":
        script = Path(__file__).with_name("service_on_ray.py")
        return [sys.executable, str(script), "ray" if cluster else "here", str(memory), str(port), str(IMAGE_S)]
    serve = [sys.executable, "-m", "clients.cli", "serve", "--port", str(port), "--data-dir", str(memory)]
    return [*serve, "--cluster"] if cluster else serve


def measured(kind: str, cluster: bool) -> list[dict[str, Any]]:
    """A row for each number of robots."""
    with TemporaryDirectory() as scratch:
        folder, port = Path(scratch), free_port()
        data = eggs(folder / "data") if kind == "sleeping" else None
        with started(command(kind, cluster, folder / "memory", port), port, folder / "log") as service:
            url = str(service.http.base_url).rstrip("/")
            load.run(folder / "rows.json", None, robots=ROBOTS, seconds=SECONDS[kind], views=VIEWS, data=data, url=url, seed=0)
        rows: list[dict[str, Any]] = json.loads((folder / "rows.json").read_text())["rows"]
    return rows


def eggs(folder: Path) -> Path:
    """Recordings of the synthetic world, in which the sleeping backbone sees something."""
    for name, world_from_model in (("large", Sim3(0.5, np.eye(3), np.zeros(3))), ("small", Sim3(0.3, np.eye(3), np.ones(3)))):
        record(folder / "egg" / name, Ellipsoid(HALF_AXES), world_from_model)
    return folder


def draw(picture: Path, found: dict[str, dict[str, list[dict[str, Any]]]]) -> None:
    """Answers a second against robots, a panel for each kind."""
    figure = Figure((4.5 * len(found), 3.6), layout="constrained")
    panels = figure.subplots(1, len(found), squeeze=False)
    for panel, (kind, both) in zip(panels[0], found.items()):
        for label, rows in both.items():
            panel.plot([row["robots"] for row in rows], [row["per_s"] for row in rows], "o-", label=label)
        panel.set_xscale("log", base=2)
        panel.set_xticks(ROBOTS, [str(each) for each in ROBOTS])
        panel.set(title=KINDS[kind], xlabel="robots", ylabel="observations a second", ylim=(0, None))
        panel.legend()
        panel.grid(alpha=0.3)
    figure.savefig(picture, dpi=110)


def main(picture: Path, out: Path, kinds: list[str]) -> None:
    """Measures the kinds named, all where none is, beside what OUT has already; draws all of it."""
    found = json.loads(out.read_text()) if out.exists() else {}
    os.environ |= {"ONELOOK_WORKERS": "4"}
    for kind in kinds or KINDS:
        found[kind] = {label: measured(kind, cluster) for label, cluster in (("one process", False), ("two encoders, two solvers", True))}
        out.write_text(json.dumps(found, indent=1))
    draw(picture, found)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:])
