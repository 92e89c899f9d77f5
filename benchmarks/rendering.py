"""How fast the simulated world renders: time to light an object anew, and frames a second at 640×480 with all faults of the camera."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from benchmarks.parallel import bar
from benchmarks.tables import report
from clients.simulator.raycast.export import draw_models
from clients.simulator.raycast.model import Model
from clients.simulator.raycast.sensor import SensorConfig
from clients.simulator.raycast.world import RaycastWorld

WARM_UP = 1
"""Frames that are not counted."""


@dataclass(frozen=True)
class RenderingRow:
    """One object; `all` is the mean over objects."""

    category: str
    triangles: int
    light_ms: float
    """To put it on the table: light and shadows, and the first frame."""
    frame_ms: float
    """Median."""
    fps: float
    cpu_ms: float
    """Processor time of a frame, over all cores: what the load of other work does not touch."""


COLUMNS = tuple(field.name for field in fields(RenderingRow))


def run(json: Path | None, categories: Sequence[str], frames: int, seed: int) -> list[RenderingRow]:
    """A row for one object of each category, all of them where none is named; prints a table. Raises InvalidInput for an unknown one."""
    models = draw_models(categories, 1, seed)
    with bar() as progress:
        task = progress.add_task("rendering", total=len(models))
        rows = []
        for model in models:
            progress.update(task, description=f"rendering {model.name}")
            rows.append(_measure(model, frames, seed))
            progress.advance(task)
    values = [[getattr(row, name) for name in COLUMNS[1:]] for row in rows]
    triangles, *means = np.mean(values, axis=0).tolist()
    rows.append(RenderingRow("all", round(triangles), *means))
    meta = {"benchmark": "rendering", "frames": frames, "seed": seed, "size": list(SensorConfig().size), "cores": os.cpu_count()}
    report(f"Rendering, {frames} frames of each object", rows, meta, json)
    return rows


def _measure(model: Model, frames: int, seed: int) -> RenderingRow:
    world = RaycastWorld(seed)
    world.show([model])
    poses = world.viewpoints(frames + WARM_UP, seed)
    started = time.perf_counter()
    for pose in poses[:WARM_UP]:
        world.capture(pose)
    light_ms = (time.perf_counter() - started) * 1e3
    wall, busy = [], time.process_time()
    for pose in poses[WARM_UP:]:
        started = time.perf_counter()
        world.capture(pose)
        wall.append((time.perf_counter() - started) * 1e3)
    cpu_ms = (time.process_time() - busy) * 1e3 / frames
    frame_ms = float(np.median(wall))
    return RenderingRow(model.category, len(model.mesh.triangles), light_ms, frame_ms, 1e3 / frame_ms, cpu_ms)
