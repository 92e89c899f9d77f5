"""The curves of the discovery benchmark as one picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from benchmarks.pictures import save

PAPER = (0.0, 26.0)
"""FP and FN that the paper reports, in percent, on CO3D with DINO."""


def plot(file: Path, rows: Sequence[Mapping[str, Any]], title: str) -> None:
    """FN against FP with the band of 90 % of the episodes, and the growth of the memory at 1 % FP against the truth."""
    figure = Figure((11, 4.5), layout="constrained")
    errors, growth = figure.subplots(1, 2)
    truth = None
    for name in dict.fromkeys(str(row["score"]) for row in rows):
        curve = sorted((row for row in rows if row["score"] == name and "auroc" not in row), key=lambda row: (row["fp"], -row["fn"]))
        (line,) = errors.plot([row["fp"] for row in curve], [row["fn"] for row in curve], label=name)
        lower, upper = ([row["fn_band"][side] for row in curve] for side in (0, 1))
        errors.fill_between([row["fp"] for row in curve], lower, upper, color=line.get_color(), alpha=0.15, linewidth=0)
        summary = next(row for row in rows if row["score"] == name and "auroc" in row)
        growth.plot(summary["categories_at_one_fp"], color=line.get_color(), label=name)
        truth = summary["true_categories"]
    errors.plot(*PAPER, "k*", markersize=10, label="the paper, on CO3D with DINO", clip_on=False)
    errors.set(
        xlim=(-0.3, 15), ylim=(-2, 102), xlabel="false positives, % of bursts presented", ylabel="false negatives, % of bursts seen before"
    )
    errors.legend(fontsize=8)
    growth.plot(truth, "k--", label="true categories met")
    growth.set(xlabel="bursts presented", ylabel="categories, at 1 % false positives")
    growth.legend(fontsize=8)
    save(figure, file, title)
