"""How numbers and times are worded on a page."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

SHORT = 8
"""Characters of an id that people compare."""
FEW = 4
"""Enough to tell the categories of a page apart."""


def milliseconds(value: float) -> str:
    """840 ms, 5.9 s."""
    return f"{value:.0f} ms" if value < 1000 else f"{value / 1000:.1f} s"


def metres(value: float) -> str:
    """4.2 cm, 1.30 m."""
    return f"{100 * value:.1f} cm" if value < 1 else f"{value:.2f} m"


def percent(share: float) -> str:
    """87 %."""
    return f"{100 * share:.0f} %"


def short_id(identifier: str) -> str:
    """Its first characters."""
    return identifier[:SHORT]


def clock(iso: str) -> str:
    """2026-01-31 12:00:00 UTC of an ISO 8601 time; the browser words it in its own zone."""
    return f"{iso[:10]} {iso[11:19]} UTC"


def called(name: str | None, identifier: str | None) -> str:
    """A category's name, else the beginning of its id; it may be gone."""
    if identifier is None:
        return "a category that is gone"
    return name or f"unnamed {identifier[:FEW]}"


def decimal(value: float | None, digits: int = 2) -> str:
    """With so many digits; a dash where there is none."""
    return "–" if value is None else f"{round(value, digits) + 0.0:.{digits}f}"  # never -0.00


FILTERS: dict[str, Callable[..., Any]] = {
    "milliseconds": milliseconds,
    "metres": metres,
    "percent": percent,
    "short_id": short_id,
    "clock": clock,
    "called": called,
    "decimal": decimal,
}
"""By their names in templates."""
