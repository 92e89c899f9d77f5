"""The evidence of objects that are of no known category, and of those that are, as a chart: what lies right of the threshold is known.

Coordinates are those of the drawing: WIDTH by HEIGHT, y downwards.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.views import FloatArray
from service.upkeep import Distribution

WIDTH, HEIGHT = 640, 210
BASE = 130
"""Where the curves stand; the decisions are below."""
ROOM = 8
LANES = 5
"""Dots of equal evidence are beside each other in so many rows."""
LANE = 11
SAMPLES = 160
REACH = 4.0
"""Spreads that a curve is drawn to."""
TICKS = 6


@dataclass(frozen=True)
class Dot:
    """A decision."""

    x: float
    y: float
    outcome: str
    similarity: float


@dataclass(frozen=True)
class Mark:
    """A limit, or a number of the axis."""

    x: float
    value: float


@dataclass(frozen=True)
class ScoreChart:
    """See module."""

    width: int
    height: int
    base: int
    rivals: str
    """A filled path."""
    own: str
    dots: tuple[Dot, ...]
    known: Mark
    uncertain: Mark
    ticks: tuple[Mark, ...]
    own_rivals: int
    """Decisions of this memory that the threshold is made of."""


def score_chart(found: Distribution) -> ScoreChart:
    """Both curves have the same height: each says where its kind lies, not how frequent it is."""
    fit = found.calibration
    scores = [(each.similarity, each.outcome) for each in found.decisions if each.similarity is not None]
    values = [value for value, _ in scores]
    low = min(fit.location - REACH * fit.spread, *values, found.levels.uncertain_above)
    high = max(fit.own_location + REACH * fit.spread, *values, found.levels.known_above)
    scale = (WIDTH - 2 * ROOM) / (high - low)

    def across(value: float) -> float:
        return round(ROOM + (value - low) * scale, 2)

    grid = np.linspace(low, high, SAMPLES)
    student = (1 + ((grid - fit.location) / fit.spread) ** 2 / fit.freedom) ** (-(fit.freedom + 1) / 2)
    normal = np.exp(-(((grid - fit.own_location) / fit.spread) ** 2) / 2)
    columns = np.array([across(each) for each in grid])
    dots = [Dot(across(value), BASE + 20 + index % LANES * LANE, outcome, value) for index, (value, outcome) in enumerate(scores)]
    return ScoreChart(
        WIDTH,
        HEIGHT,
        BASE,
        _area(columns, student),
        _area(columns, normal),
        tuple(dots),
        Mark(across(found.levels.known_above), found.levels.known_above),
        Mark(across(found.levels.uncertain_above), found.levels.uncertain_above),
        tuple(Mark(across(value), value) for value in _round_numbers(low, high)),
        len(found.rivals),
    )


def _area(columns: FloatArray, heights: FloatArray) -> str:
    tops = BASE - heights * (BASE - 2 * ROOM)
    line = " ".join(f"{x:g},{y:.1f}" for x, y in zip(columns, tops))
    return f"M{columns[0]:g},{BASE} L{line} L{columns[-1]:g},{BASE} Z"


def _round_numbers(low: float, high: float) -> list[float]:
    rough = (high - low) / TICKS
    power = 10.0 ** np.floor(np.log10(rough))
    step = next(power * each for each in (1, 2, 5, 10) if power * each >= rough)
    return [float(round(each * step, 6)) for each in range(int(np.ceil(low / step)), int(np.floor(high / step)) + 1)]
