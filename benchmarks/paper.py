"""The paper's tables 1 and 2, each published row beside the same method on another data set.

The figures do not compare implementations: the paper's are of 20 categories of CO3D with DINO's ViT-S/8, and of 30 views where it says "+".
What can be compared is what one step changes within a column.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.contenders import Sweep
from benchmarks.pose import PoseRow, measure
from benchmarks.tables import report

FEW, ALL = "10", "all"


@dataclass(frozen=True)
class Published:
    """A row of the paper: rotation accuracy in percent, errors in degrees."""

    table: int
    method: str
    views: int
    """Of reference and target each, but for Goodwin 2022, which has one of the reference."""
    dims: int | None
    """Descriptor size; None where the method has none."""
    median_deg: float
    acc30: float
    acc15: float
    acc7_5: float
    ours: tuple[str, str, int] | None
    """The row of ours: variant, views, descriptor size; None where there is none."""
    ms: float | None = None
    mb: float | None = None
    """Of a reference's descriptors."""


PUBLISHED = (
    Published(1, "TEASER++", 10, None, 126.4, 3.75, 1.1, 0.3, None),
    Published(1, "Goodwin2022", 10, 384, 47.7, 49.4, 28.35, 9.6, ("zsp", FEW, 384)),
    Published(1, "Ours-R", 10, 384, 58.0, 29.9, 13.4, 4.4, ("r", FEW, 384)),
    Published(1, "Ours-RC", 10, 384, 32.7, 56.6, 35.0, 13.1, ("rc", FEW, 384)),
    Published(1, "Ours-U", 10, 384, 36.9, 59.4, 45.7, 26.6, ("u", FEW, 384)),
    Published(1, "Ours-UC", 10, 384, 31.9, 61.5, 47.5, 27.4, ("uc", FEW, 384)),
    Published(1, "Ours-UCD", 10, 32, 26.2, 64.5, 49.4, 29.2, ("ucd", FEW, 32)),
    Published(1, "Ours-UCD+", 30, 32, 21.4, 69.8, 54.6, 34.5, ("ucd+", ALL, 32)),
    Published(2, "UCD", 10, 384, 25.8, 61.4, 39.7, 17.2, ("uc", FEW, 384), 2.96, 12.0),
    Published(2, "UCD", 10, 32, 23.7, 66.2, 43.0, 18.3, ("ucd", FEW, 32), 2.6, 1.0),
    Published(2, "UCD", 10, 6, 32.0, 51.6, 29.5, 11.2, ("ucd", FEW, 6), 2.6, 0.2),
    Published(2, "UCD", 10, 3, 59.2, 35.8, 17.1, 5.9, ("ucd", FEW, 3), 2.6, 0.1),
    Published(2, "UCD", 20, 384, 22.1, 68.4, 49.6, 25.9, None, 4.06, 24.1),
    Published(2, "UCD", 20, 32, 22.0, 69.8, 50.1, 24.0, None, 3.36, 2.0),
    Published(2, "UCD", 30, 384, 20.4, 69.9, 51.4, 25.4, ("uc", ALL, 384), 5.18, 36.1),
    Published(2, "UCD", 30, 32, 20.3, 72.1, 52.4, 26.2, ("ucd+", ALL, 32), 4.23, 3.0),
)
"""Table 2 was measured with a wider inlier threshold than table 1 (appendix, "RANSAC inlier threshold"); ours is the same in both.
The paper names 24 dimensions too, without figures."""
SWEEPS = (
    Sweep(["zsp", "r", "rc", "u", "uc", "ucd", "ucd+"], [FEW]),
    Sweep(["ucd"], [FEW], dims=[24, 6, 3]),
    Sweep(["uc"], [ALL]),
)


@dataclass(frozen=True)
class PaperRow:
    """A published row and ours; fields of either are None where there is no such row."""

    table: int
    method: str
    paper_views: int | None
    dims: int | None
    paper_median_deg: float | None
    paper_acc30: float | None
    paper_acc15: float | None
    paper_acc7_5: float | None
    paper_ms: float | None
    paper_mb: float | None
    variant: str | None
    views: str | None
    pairs: int | None
    median_deg: float | None
    acc30: float | None
    acc15: float | None
    acc7_5: float | None
    solve_ms: float | None
    memory_mb: float | None


TAKEN = ("variant", "views", "pairs", "median_deg", "acc30", "acc15", "acc7_5", "solve_ms", "memory_mb")
"""Of ours."""


def run(data: Path, limit: int | None, json: Path | None, seed: int, backbone: str) -> list[PaperRow]:
    """Measures every row of both tables on `data`; prints and returns them beside the published ones. See `benchmarks.pose.run`."""
    measured, meta = measure(data, SWEEPS, limit, seed, backbone)
    rows = beside([row for row in measured if row.category == "all"])
    report(f"The paper's tables; ours on {data}, other data and another backbone", rows, {**meta, "benchmark": "paper"}, json)
    return rows


def beside(measured: Sequence[PoseRow]) -> list[PaperRow]:
    """The published rows in the paper's order, then what was measured besides."""
    ours = {(row.variant, row.views, row.dims): row for row in measured}
    rows = [_row(each, ours.get(each.ours) if each.ours else None) for each in PUBLISHED]
    left = ours.keys() - {each.ours for each in PUBLISHED}
    return rows + [_row(None, ours[key]) for key in sorted(left)]


def _row(published: Published | None, measured: PoseRow | None) -> PaperRow:
    taken = {name: None if measured is None else getattr(measured, name) for name in TAKEN}
    if published is None:
        return PaperRow(2, "not published", None, measured.dims if measured else None, None, None, None, None, None, None, **taken)
    figures = (published.median_deg, published.acc30, published.acc15, published.acc7_5, published.ms, published.mb)
    return PaperRow(published.table, published.method, published.views, published.dims, *figures, **taken)
