"""An episode's decisions as a chart: similarity against the threshold, and the rotation error, one column an encounter.

Coordinates are those of an SVG of width WIDTH, y downwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from clients.simulator.encounter import Encounter
from clients.simulator.summary import ACC_DEG

WIDTH = 1120
LEFT = 56
SIMILARITY_TOP, SIMILARITY_HEIGHT = 16, 150
ERROR_TOP, ERROR_HEIGHT = 214, 96
LABELLED = 16
"""Columns up to this many have room for the objects' kinds."""
NUMBER_WIDTH = 26
"""What a number below a column takes: of narrower columns not each is numbered."""
ERROR_TOP_DEG = 2 * ACC_DEG[0]
"""Height of the error's panel; a pose farther off than this is wrong however far, and its bar ends at the top."""


@dataclass(frozen=True)
class Mark:
    """One encounter in one of the panels."""

    encounter: Encounter
    x: float
    y: float
    value: float


@dataclass(frozen=True)
class Tick:
    """A labelled height."""

    y: float
    label: str


class Timeline:
    """Where everything stands in the chart."""

    width = WIDTH
    left = LEFT
    bottom = ERROR_TOP + ERROR_HEIGHT
    similarity_top = SIMILARITY_TOP
    error_top = ERROR_TOP

    def __init__(self, encounters: Sequence[Encounter]) -> None:
        self.encounters = encounters
        self._places = {id(each): place for place, each in enumerate(encounters)}
        self._step = (WIDTH - LEFT) / max(1, len(encounters))
        asked = [(each, each.similarity) for each in encounters if each.similarity is not None]
        limited = [(each, each.threshold) for each in encounters if each.threshold is not None]
        values = [value for _, value in [*asked, *limited]] or [0.0, 1.0]
        margin = 0.08 * (max(values) - min(values)) or 0.1
        self._low, self._high = min(values) - margin, max(values) + margin
        self.similarities = [Mark(each, self.x(each), self._similarity_y(value), value) for each, value in asked]
        self.threshold = Tick(self._similarity_y(limited[-1][1]), f"{limited[-1][1]:.2f}") if limited else None
        self.limits = [Mark(each, self.x(each), self._similarity_y(value), value) for each, value in limited]
        self.half_step = round(self._step / 2, 1)
        posed = [(each, each.error.rotation_deg) for each in encounters if each.error is not None]
        self.errors = [Mark(each, self.x(each), self._error_y(degrees), degrees) for each, degrees in posed]
        self.acc = Tick(self._error_y(ACC_DEG[0]), f"{ACC_DEG[0]:.0f}°")
        self.zero = Tick(self._error_y(0.0), "0°")

    @property
    def height(self) -> int:
        """Of the SVG, the labels below included."""
        return self.bottom + (44 if self.labelled else 26)

    @property
    def labelled(self) -> bool:
        """Whether the columns carry the objects' kinds."""
        return len(self.encounters) <= LABELLED

    @property
    def numbered(self) -> Sequence[Encounter]:
        """Those whose columns carry their number."""
        return self.encounters[:: max(1, round(NUMBER_WIDTH / self._step + 0.5))]

    def x(self, encounter: Encounter) -> float:
        """The middle of an encounter's column: they stand in the order in which they happened, whichever robot's they are."""
        return round(LEFT + (self._places[id(encounter)] + 0.5) * self._step, 1)

    def _similarity_y(self, value: float) -> float:
        return round(SIMILARITY_TOP + SIMILARITY_HEIGHT * (self._high - value) / (self._high - self._low), 1)

    def _error_y(self, degrees: float) -> float:
        return round(ERROR_TOP + ERROR_HEIGHT * (1 - min(degrees / ERROR_TOP_DEG, 1)), 1)
