"""The stages of one observation, one after the other, as a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmarks.pictures import save

ROOM_FOR_MS = 1.12
"""The axis, of the longest bar's end: its milliseconds are written behind it."""


def plot(file: Path, stages: Sequence[tuple[str, float, float]], title: str) -> None:
    """A waterfall. `stages` are a name, milliseconds, and milliseconds of the straightforward way, NaN where there is none."""
    figure = Figure((9, 0.45 * len(stages) + 1.4), layout="constrained")
    axes = figure.subplots()
    start = end = 0.0
    for place, (_, ms, straightforward_ms) in enumerate(stages):
        axes.barh(place, straightforward_ms, left=start, height=0.7, color="0.88", label="straightforward" if place == 0 else None)
        axes.barh(place, ms, left=start, height=0.7, color="tab:blue", label="as it is" if place == 0 else None)
        longest = start + float(np.nanmax([ms, straightforward_ms]))
        axes.text(longest, place, f" {ms:.0f} ms", va="center", color="tab:blue")
        start, end = start + ms, max(end, longest)
    axes.invert_yaxis()
    axes.set(xlabel="milliseconds", title=title)
    axes.set_yticks(range(len(stages)), [name for name, _, _ in stages])
    axes.set_xlim(0, ROOM_FOR_MS * end)
    axes.legend(loc="lower left")
    save(figure, file)
