"""Isolation: how well the foreground that is found covers the object's silhouette, for each source of foreground.

The found foreground is what the product uses: the patches of the close crop after two passes. Silhouettes only score.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby, islice
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.encoded import encode_all, read_encoded
from benchmarks.tables import report
from clients.datasets import folders
from clients.datasets.sources import find_sequences
from core.backbones import load_backbone
from core.encode import EncodedView, Encoder, EncoderConfig
from core.errors import InvalidInput

SOURCES = ("attention", "saliency")
DEFAULT_LIMIT = 3
"""Sequences a category."""
MISSED_RECALL = 0.1
"""Share of the object that must be found, else it counts as missed."""


@dataclass(frozen=True)
class IsolationRow:
    """One line of the table."""

    source: str
    category: str
    views: int
    iou: float
    """Mean over views of intersection over union, percent."""
    precision: float
    """Mean share of the found foreground that is object, percent; views without foreground left out."""
    recall: float
    """Mean share of the object that was found, percent."""
    missed: float
    """Percentage of views in which less than a tenth of the object was found."""


MEAN_COLUMNS = ("iou", "precision", "recall", "missed")
"""What an "all" row averages over categories."""


def run(data: Path, json: Path | None, sources: Sequence[str], limit: int | None, backbone: str) -> list[IsolationRow]:
    """Compares `sources` of foreground on up to `limit` sequences a category of `data`; prints and returns the table.

    Raises InvalidInput where no view has a silhouette, or for a source that the backbone does not have.
    """
    groups = folders.by_category(find_sequences(data)).values()
    most = DEFAULT_LIMIT if limit is None else limit
    sequences = [sequence for group in groups for sequence in islice(filter(_has_silhouettes, group), most)]
    if not sequences:
        expected = "in the data layout mask_visib/000000_000000.png for rgb/000000.*"
        raise InvalidInput("data", f"no view below {data} has a silhouette, which this benchmark scores against: {expected}")
    network = load_backbone(backbone)
    rows: list[IsolationRow] = []
    for source in sources:
        files = encode_all(sequences, Encoder(network, EncoderConfig(foreground=source)))
        rows += table_rows(source, [(each.category, score) for each, file in zip(sequences, files) for score in _scores(each, file)])
    meta = {"benchmark": "isolation", "data": data, "limit": limit, "backbone": network.name, "fingerprint": network.fingerprint}
    report(f"Isolation, {data}", rows, meta, json)
    return rows


@dataclass(frozen=True)
class Overlap:
    """Found foreground against the silhouette of one view, shares of 1."""

    iou: float
    precision: float
    """NaN where nothing was found."""
    recall: float


def overlap(found: NDArray[np.bool_], truth: NDArray[np.bool_]) -> Overlap:
    """From masks of shape (H, W); `truth` is not empty."""
    both = int((found & truth).sum())
    precision = both / int(found.sum()) if found.any() else float("nan")
    return Overlap(both / int((found | truth).sum()), precision, both / int(truth.sum()))


def found_mask(view: EncodedView, height: int, width: int) -> NDArray[np.bool_]:
    """The view's foreground patches painted into its image, shape (H, W)."""
    cells = np.zeros((view.grid, view.grid), dtype=np.uint8)
    cells[view.cells[:, 0], view.cells[:, 1]] = 1
    window = view.window
    square = cv2.resize(cells, (window.size, window.size), interpolation=cv2.INTER_NEAREST_EXACT).astype(bool)
    mask = np.zeros((height, width), dtype=bool)
    top, left = max(0, window.y0), max(0, window.x0)
    inside = square[top - window.y0 : height - window.y0, left - window.x0 : width - window.x0]
    mask[top : top + inside.shape[0], left : left + inside.shape[1]] = inside
    return mask


def _has_silhouettes(sequence: folders.Sequence) -> bool:
    """One view is read after the other: mostly the first has one."""
    indices = range(len(sequence.images))
    return any(folders.load_burst(sequence, [index], masks=True).views[0].mask is not None for index in indices)


def _scores(sequence: folders.Sequence, file: Path) -> list[Overlap]:
    burst = folders.load_burst(sequence, masks=True)
    pairs = zip(burst.views, read_encoded(file).views)
    return [overlap(found_mask(encoded, *view.size), view.mask) for view, encoded in pairs if view.mask is not None]


def table_rows(source: str, scores: Sequence[tuple[str, Overlap]]) -> list[IsolationRow]:
    """One row for each category, sorted, and the "all" row: the mean over categories. `scores` holds (category, overlap) of each view."""
    ordered = sorted(scores, key=lambda entry: entry[0])
    groups = groupby(ordered, key=lambda entry: entry[0])
    rows = [_category_row(source, category, [overlap for _, overlap in group]) for category, group in groups]
    means = {column: float(np.mean([getattr(row, column) for row in rows])) for column in MEAN_COLUMNS}
    return [*rows, replace(rows[0], category="all", views=sum(row.views for row in rows), **means)]  # type: ignore[arg-type]


def _category_row(source: str, category: str, overlaps: Sequence[Overlap]) -> IsolationRow:
    precisions = [each.precision for each in overlaps if np.isfinite(each.precision)]
    return IsolationRow(
        source=source,
        category=category,
        views=len(overlaps),
        iou=100 * float(np.mean([each.iou for each in overlaps])),
        precision=100 * float(np.mean(precisions)) if precisions else 0.0,
        recall=100 * float(np.mean([each.recall for each in overlaps])),
        missed=100 * float(np.mean([each.recall < MISSED_RECALL for each in overlaps])),
    )
