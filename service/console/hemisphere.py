"""A scan's viewpoints as a picture: the hemisphere about the object, seen from the side and a little from above."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from core.scan import Coverage, ScanRequest

RADIUS = 84.0
"""Of the hemisphere, in units of the picture, which is WIDTH × HEIGHT of them."""
WIDTH, HEIGHT = 200.0, 138.0
CENTRE = (100.0, 100.0)
TILT_DEG = 24.0
"""Of the line of sight below the horizon."""
MERIDIANS = 6
STEPS = 24


@dataclass(frozen=True)
class Mark:
    """A viewpoint, or a view that came."""

    x: float
    y: float
    behind: bool
    """Beyond the object, as seen here."""
    covered: bool
    number: int


@dataclass(frozen=True)
class Hemisphere:
    """Ready to be drawn."""

    marks: tuple[Mark, ...]
    """Far ones first."""
    lines: tuple[str, ...]
    """Meridians, as an SVG path each."""
    covered: int
    radius: float = RADIUS
    flat: float = RADIUS * float(np.sin(np.radians(TILT_DEG)))
    """Half the height of its rim."""
    centre: tuple[float, float] = CENTRE
    size: tuple[float, float] = (WIDTH, HEIGHT)


def hemisphere_of(request: ScanRequest, coverage: Coverage) -> Hemisphere:
    """Of a scan and how far it is."""
    level = np.linalg.svd(np.asarray(request.up, dtype=float)[None])[2]
    side, ahead = level[1], np.cross(np.asarray(request.up, dtype=float), level[1])
    axes = np.stack([side, ahead, request.up])
    directions = (np.asarray(request.world_from_camera)[:, :3, 3] - request.center_m) @ axes.T
    directions /= np.maximum(np.linalg.norm(directions, axis=1, keepdims=True), 1e-9)
    points, behind = _projected(directions)
    marks = [
        Mark(round(float(x), 1), round(float(y), 1), bool(far), bool(covered), number)
        for number, ((x, y), far, covered) in enumerate(zip(points, behind, coverage.covered))
    ]
    return Hemisphere(tuple(sorted(marks, key=lambda mark: not mark.behind)), _meridians(), sum(coverage.covered))


def _projected(directions: NDArray[np.floating]) -> tuple[NDArray[np.floating], NDArray[np.bool_]]:
    """Of unit vectors (side, ahead, up), shape (n, 3): where they are in the picture, shape (n, 2), and which are beyond the object."""
    tilt = np.radians(TILT_DEG)
    across, ahead, up = directions.T
    y = up * np.cos(tilt) + ahead * np.sin(tilt)
    return np.stack([CENTRE[0] + RADIUS * across, CENTRE[1] - RADIUS * y], axis=1), ahead > 0


def _meridians() -> tuple[str, ...]:
    drawn = []
    for turn in np.arange(MERIDIANS) * np.pi / MERIDIANS:
        angle = np.linspace(0, np.pi, STEPS)
        arc = np.stack([np.cos(angle) * np.cos(turn), np.cos(angle) * np.sin(turn), np.sin(angle)], axis=1)
        points, _ = _projected(arc)
        drawn.append("M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points))
    return tuple(drawn)
