"""The curves of the robustness benchmark, one small picture for each degradation, all in one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from benchmarks.pictures import save
from benchmarks.tables import Row

FILE = "robustness.png"
COLUMNS = 4
LINES = {
    "acc30": ("pose within 30°, %", "o-", "pairs"),
    "acc15": ("within 15°, %", "o--", "pairs"),
    "auroc": ("own kind known from not, AUROC × 100", "s-", None),
    "nearest": ("most similar kind is the right one, %", "^:", "bursts"),
}
"""Of each figure its name, its style, and what it is a share of."""


def plot(folder: Path, rows: Sequence[Row]) -> None:
    """Writes FILE below `folder`: the undegraded first; shares with one standard error."""
    clean, breaks = rows[0], [row for row in rows if "acc30" not in row]
    down = -(-len(breaks) // COLUMNS)
    figure = Figure((3.5 * COLUMNS, 2.9 * down), layout="constrained")
    grid = figure.subplots(down, COLUMNS, sharey=True, squeeze=False)
    for axes, about in zip(grid.flat, breaks):
        curve = [clean, *(row for row in rows if row["degradation"] == about["degradation"] and "acc30" in row)]
        _draw(axes, curve)
        labels = [about["none"], *(row["strength"] for row in curve[1:])]
        axes.set(title=about["degradation"], xlabel=about["unit"], ylim=(-3, 103), xticks=range(len(curve)))
        axes.set_xticklabels([f"{label:g}" for label in labels])
    for axes in grid.flat[len(breaks) :]:
        axes.axis("off")
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=len(LINES))
    save(figure, folder / FILE)


def _draw(axes: Any, curve: Sequence[Row]) -> None:
    for figure, (label, style, of) in LINES.items():
        values = np.array([row[figure] for row in curve], dtype=float)
        (line,) = axes.plot(values, style, markersize=4, label=label)
        if of is not None:
            error = np.sqrt(values * (100 - values) / np.array([row[of] for row in curve], dtype=float))
            axes.fill_between(
                range(len(curve)), values - error, (values + error).clip(max=100), color=line.get_color(), alpha=0.15, linewidth=0
            )
    axes.grid(alpha=0.3)
