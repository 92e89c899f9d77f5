"""What an answer rests on, made ready to be drawn: which views were compared, other poses that were considered, where the time went.

Letters: M reference views, N views of the burst.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from core.sim3 import rotation_angle_deg
from service.features import PoseDetails
from store.records import Pose

WHOLE = "total"
"""Key of the timings that is no stage."""
PARTS = {"find": "encode", "features": "encode", "points": "encode", "decide": "decide"}
"""The part of the work that a stage is of; all others are the pose's."""


@dataclass(frozen=True)
class Cell:
    """A reference view against a view of the burst."""

    row: int
    """Reference view."""
    column: int
    """View of the burst."""
    similarity: float
    level: float
    """In [0, 1], from the least to the most similar pair."""
    chosen: bool
    inliers: int


@dataclass(frozen=True)
class Matrix:
    """The pairs of views that were compared (paper, Figure 2): with many reference views each view of the burst is with some alone."""

    rows: int
    columns: int
    low: float
    high: float
    cells: tuple[Cell, ...]
    rests_on: tuple[int, ...]
    """Views of the burst with a chosen pair."""

    @staticmethod
    def of(details: PoseDetails) -> Matrix:
        """Of the pose of an observation."""
        similarity, matches = np.asarray(details.view_similarity, dtype=float), details.matches
        rows, columns = similarity.shape
        compared = np.argwhere(similarity > 0)
        values = similarity[similarity > 0] if len(compared) else np.zeros(1)
        low, high = float(values.min()), float(values.max())
        inliers = np.zeros((rows, columns), dtype=int)
        np.add.at(inliers, (matches.reference_view[matches.inlier], matches.target_view[matches.inlier]), 1)
        chosen = set(details.pairs)
        cells = [
            Cell(
                row,
                column,
                float(similarity[row, column]),
                round((float(similarity[row, column]) - low) / max(high - low, 1e-9), 3),
                (row, column) in chosen,
                int(inliers[row, column]),
            )
            for row, column in compared.tolist()
        ]
        return Matrix(rows, columns, low, high, tuple(cells), tuple(sorted({column for _, column in chosen})))


@dataclass(frozen=True)
class Hypothesis:
    """A pose that was considered."""

    score: float | None
    confidence: float | None
    turned_deg: float
    """From the pose that was answered, the least over the object's symmetries."""
    scale: float

    @staticmethod
    def all_of(pose: Pose) -> list[Hypothesis]:
        """The pose that was answered, then the alternatives."""
        own = pose.target_from_reference
        twins = [np.eye(3), *pose.symmetries]
        others = [
            Hypothesis(
                each.score,
                each.confidence,
                min(float(rotation_angle_deg(each.target_from_reference.rotation @ twin, own.rotation)) for twin in twins),
                each.target_from_reference.scale,
            )
            for each in pose.alternatives
        ]
        return [Hypothesis(pose.score, pose.confidence, 0.0, own.scale), *others]


@dataclass(frozen=True)
class Stage:
    """A stretch of the time that an answer took."""

    name: str
    part: str
    spent_ms: float
    start: float
    """In percent of all stages."""
    width: float

    @staticmethod
    def all_of(timings_ms: Mapping[str, float]) -> list[Stage]:
        """One after the other."""
        spent = {name: value for name, value in timings_ms.items() if name != WHOLE}
        all_ms = max(sum(spent.values()), 1e-9)
        stages, start = [], 0.0
        for name, value in spent.items():
            width = 100 * value / all_ms
            stages.append(Stage(name, PARTS.get(name, "pose"), value, start, width))
            start += width
        return stages
