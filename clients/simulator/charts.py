"""The report's charts as numbers: who was taken for what, errors against threshold, errors of poses, time for each stage.

Coordinates are those of SVGs, y downwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clients.simulator.encounter import Encounter, Verdict
from clients.simulator.live import stage_ms
from clients.simulator.summary import scored_errors

NOVEL, UNDECIDED, UNKNOWN = "novel", "undecided", "a forgotten one"
BINS_DEG = (0.0, 2.5, 5.0, 7.5, 15.0, 30.0, 60.0, 120.0, 180.0)
"""Edges of the histogram: the three accuracies among them."""
CURVE_WIDTH, CURVE_HEIGHT = 520, 220


@dataclass(frozen=True)
class Confusion:
    """Rows are true categories, columns what objects were taken for."""

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    counts: tuple[tuple[int, ...], ...]
    first: tuple[int, ...]
    """Of each row, how many were novel rightly."""

    @staticmethod
    def of(encounters: Sequence[Encounter]) -> Confusion:
        """Categories in alphabetical order, then what is no category."""
        rows = tuple(sorted({each.category for each in encounters}))
        taken = [(each.category, _taken_for(each)) for each in encounters]
        ends = [end for end in (NOVEL, UNDECIDED, UNKNOWN) if any(name == end for _, name in taken)]
        columns = (*sorted({name for _, name in taken} - set(ends)), *ends)
        counts = tuple(tuple(taken.count((row, column)) for column in columns) for row in rows)
        first = tuple(sum(each.category == row and each.verdict is Verdict.NEW for each in encounters) for row in rows)
        return Confusion(rows, columns, counts, first)

    def right(self, row: int, column: int) -> bool:
        """Whether a cell counts right decisions; those novel for the first time are right too, and are said apart."""
        return self.rows[row] == self.columns[column]


@dataclass(frozen=True)
class Bar:
    """A labelled share of something."""

    label: str
    count: float
    percent: float
    """Of the largest, for its length."""


@dataclass(frozen=True)
class Curve:
    """False known and false novel, percent, against the threshold, with every other decision as it was."""

    false_known: str
    """Points of an SVG polyline."""
    false_novel: str
    low: float
    high: float
    """Thresholds at both ends."""
    threshold_x: float | None
    """Where the threshold used lies, if all objects had the same."""
    top: float
    """Percent at the top."""
    width: int = CURVE_WIDTH
    height: int = CURVE_HEIGHT


def error_rates(encounters: Sequence[Encounter], thresholds: Sequence[float]) -> tuple[list[float], list[float]]:
    """(false known in percent of all that met a memory, false novel in percent of those whose category was in it) at each threshold.

    Each object is decided anew by its own similarity, against the memory as it was then.
    """
    asked = [each for each in encounters if each.similarity is not None]
    known = [each for each in asked if each.in_memory]
    wrong = [each for each in asked if each.nearest_kind != each.category]
    false_known = [100 * sum((each.similarity or 0) > t for each in wrong) / max(1, len(asked)) for t in thresholds]
    false_novel = [100 * sum((each.similarity or 0) <= t for each in known) / max(1, len(known)) for t in thresholds]
    return false_known, false_novel


def curve(encounters: Sequence[Encounter]) -> Curve | None:
    """None where nothing was compared."""
    values = [each.similarity for each in encounters if each.similarity is not None]
    if not values:
        return None
    used = [each.threshold for each in encounters if each.threshold is not None]
    low, high = min([*values, *used]), max([*values, *used])
    margin = 0.04 * (high - low) or 0.05
    low, high = low - margin, high + margin
    grid = np.linspace(low, high, 160).tolist()
    false_known, false_novel = error_rates(encounters, grid)
    top = max(10.0, *false_known, *false_novel)

    def points(series: Sequence[float]) -> str:
        return " ".join(f"{CURVE_WIDTH * i / (len(grid) - 1):.1f},{CURVE_HEIGHT * (1 - value / top):.1f}" for i, value in enumerate(series))

    same = len({round(each, 6) for each in used}) == 1
    return Curve(points(false_known), points(false_novel), low, high, CURVE_WIDTH * (used[0] - low) / (high - low) if same else None, top)


def pose_histogram(encounters: Sequence[Encounter]) -> list[Bar]:
    """How many rightly recognised objects have a rotation error in each bin; one without a pose is in the last."""
    degrees = [error.rotation_deg for error in scored_errors(encounters)]
    counts = np.histogram(degrees, BINS_DEG)[0]
    most = max(1, int(counts.max()))
    return [Bar(f"{low:g}–{high:g}°", int(count), 100 * int(count) / most) for low, high, count in zip(BINS_DEG, BINS_DEG[1:], counts)]


def stage_bars(encounters: Sequence[Encounter]) -> list[Bar]:
    """Median milliseconds of each stage, over the encounters that had it."""
    spent: dict[str, list[float]] = {}
    for each in encounters:
        for stage, milliseconds in stage_ms(each).items():
            spent.setdefault(stage, []).append(milliseconds)
    medians = {stage: float(np.median(values)) for stage, values in spent.items()}
    most = max([*medians.values(), 1e-9])
    return [Bar(stage, value, 100 * value / most) for stage, value in medians.items()]


def worst(encounters: Sequence[Encounter], count: int) -> list[Encounter]:
    """The encounters that went most wrong, the worst first; then the least good."""

    def badness(each: Encounter) -> tuple[int, float]:
        if each.verdict is Verdict.FALSE_KNOWN:
            return 4, each.similarity or 0.0
        if each.verdict is Verdict.FALSE_NOVEL:
            return 3, -(each.similarity or 0.0)
        if each.verdict is Verdict.RECOGNISED and each.has_truth:
            return 2, 180.0 if each.error is None else each.error.rotation_deg
        return (1 if each.verdict is Verdict.UNDECIDED else 0), 0.0

    return sorted(encounters, key=badness, reverse=True)[:count]


def _taken_for(each: Encounter) -> str:
    if each.outcome == "novel":
        return NOVEL
    return UNDECIDED if each.outcome == "uncertain" else each.kind or UNKNOWN
