"""The stages of one observation, one after the other, as a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np


def plot(file: Path, stages: Sequence[tuple[str, float, float]], title: str) -> None:
    """A waterfall. `stages` are a name, milliseconds, and milliseconds of the straightforward way, NaN where there is none."""
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(9, 0.45 * len(stages) + 1.4), constrained_layout=True)
    start = 0.0
    for place, (name, ms, straightforward_ms) in enumerate(stages):
        axes.barh(place, straightforward_ms, left=start, height=0.7, color="0.88", label="straightforward" if place == 0 else None)
        axes.barh(place, ms, left=start, height=0.7, color="tab:blue", label="as it is" if place == 0 else None)
        axes.text(start + np.nanmax([ms, straightforward_ms]), place, f" {name}, {ms:.0f} ms", va="center")
        start += ms
    axes.invert_yaxis()
    axes.set(yticks=[], xlabel="milliseconds", title=title)
    axes.set_xlim(0, 1.8 * start)
    axes.legend(loc="lower left")
    figure.savefig(file, dpi=110)
    pyplot.close(figure)
