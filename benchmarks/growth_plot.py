"""The picture of growth."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from benchmarks.pictures import save

if TYPE_CHECKING:
    from benchmarks.growth import GrowthRow

SIZE = (12, 3.8)
ROOM = 0.6
"""Share of an axis that is added above for the legend."""
TARGET_MS = 10.0
"""A decision at 10,000 categories."""


def plot_growth(file: Path, rows: Sequence[GrowthRow], title: str) -> None:
    """Against the number of categories: milliseconds of a decision, megabytes, and milliseconds of a start."""
    figure = Figure(SIZE, layout="constrained")
    decision, memory, start = figure.subplots(1, 3)
    sizes = [row.categories for row in rows]
    for name, label in (
        ("decide_ms", "a decision"),
        ("nearest_ms", "of it: nearest of all"),
        ("store_ms", "of it: the store"),
        ("new_ms", "neighbours not read yet"),
        ("learnt_ms", "after a category was learnt"),
    ):
        decision.plot(sizes, [getattr(row, name) for row in rows], "o-", label=label)
    decision.axhline(TARGET_MS, color="grey", linestyle=":", label=f"{TARGET_MS:.0f} ms")
    decision.set(ylabel="ms", yscale="log")
    megabytes = (("file_mb", "rows and tokens on the disk"), ("first_read_mb", "read by the first decision"), ("resident_mb", "resident"))
    for name, label in megabytes:
        memory.plot(sizes, [getattr(row, name) for row in rows], "o-", label=label)
    memory.set(ylabel="MB", yscale="log")
    for name, label in (("open_ms", "the memory is open"), ("first_ms", "the first decision takes")):
        start.plot(sizes, [getattr(row, name) for row in rows], "o-", label=label)
    start.set(ylabel="ms", yscale="log")
    for panel in (decision, memory, start):
        panel.set(xlabel="categories", xscale="log")
        low, high = panel.get_ylim()
        panel.set_ylim(low, high * (high / low) ** ROOM)
        panel.legend(fontsize=8, loc="upper left")
    save(figure, file, title)
