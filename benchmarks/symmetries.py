"""Symmetries: which objects are recognised as symmetric from their reference alone, against what the data declare.

A false claim is worse than a miss: it calls different poses the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import groupby
from pathlib import Path

import numpy as np

from benchmarks.encoded import encode_all, read_encoded, read_views
from benchmarks.parallel import bar
from benchmarks.tables import report
from clients.datasets import folders
from clients.datasets.sources import find_sequences
from core.backbones import load_backbone
from core.encode import Encoder
from core.errors import InvalidInput
from core.reference import build_reference
from core.sim3 import rotation_angle_deg
from core.views import FloatArray

RIGHT_DEG = 20.0
"""A claimed turn is right this near a declared one: half of the finest steps that are claimed, and their axis a little off."""


@dataclass(frozen=True)
class SymmetryRow:
    """One line of the table."""

    category: str
    objects: int
    symmetric: int
    """Objects that declare a symmetry."""
    found: int
    """Of those, the ones with a claim, all of it right."""
    complete: int
    """Of those, the ones whose every declared turn is near a claimed one, or near none at all."""
    false: int
    """Objects, symmetric or not, with a claim that is not right."""


COLUMNS = tuple(field.name for field in fields(SymmetryRow))


def run(data: Path, json: Path | None, views: int, limit: int | None, backbone: str) -> list[SymmetryRow]:
    """Builds a reference of up to `limit` objects a category, from `views` of each; prints and returns the table.

    Raises InvalidInput where no sequence has a ground truth.
    """
    groups = folders.by_category([sequence for sequence in find_sequences(data) if sequence.world_from_model is not None])
    sequences = [sequence for group in groups.values() for sequence in group[:limit]]
    if not sequences:
        raise InvalidInput("data", f"no sequence below {data} has scene_gt.json, which declared symmetries need to be compared")
    network = load_backbone(backbone)
    files = encode_all(sequences, Encoder(network))
    with bar() as progress:
        claimed = [_claimed(file, views) for file in progress.track(files, description="symmetries")]
    judged = [judge(sequence, each) for sequence, each in zip(sequences, claimed, strict=True)]
    rows = table_rows(judged)
    meta = {"benchmark": "symmetries", "data": data, "views": views, "limit": limit, "fingerprint": network.fingerprint}
    report(f"Symmetries, {data}", rows, meta, json)
    return rows


def judge(sequence: folders.Sequence, claimed: FloatArray) -> SymmetryRow:
    """One object's claims, rotations of its world, shape (S, 3, 3), against what it declares."""
    declared = np.array(sequence.symmetries, dtype=float).reshape(-1, 3, 3)
    assert sequence.world_from_model is not None
    world_from_model = sequence.world_from_model.rotation
    off = rotation_angle_deg((world_from_model.T @ claimed @ world_from_model)[:, None], declared[None])
    right = bool((off.min(axis=1, initial=180) <= RIGHT_DEG).all())
    found = bool(len(declared) and len(claimed) and right)
    unturned = rotation_angle_deg(declared, np.eye(3))
    complete = found and bool((off.min(axis=0, initial=180).clip(max=unturned) <= RIGHT_DEG).all())
    return SymmetryRow(sequence.category, 1, int(len(declared) > 0), int(found), int(complete), int(not right))


def table_rows(judged: Sequence[SymmetryRow]) -> list[SymmetryRow]:
    """One row for each category, sorted, and the "all" row: sums over objects."""
    ordered = sorted(judged, key=lambda row: row.category)
    rows = [_sum(category, list(group)) for category, group in groupby(ordered, key=lambda row: row.category)]
    return [*rows, _sum("all", rows)]


def _sum(category: str, rows: Sequence[SymmetryRow]) -> SymmetryRow:
    return SymmetryRow(category, *(sum(getattr(row, column) for row in rows) for column in COLUMNS[1:]))


def _claimed(file: Path, views: int) -> FloatArray:
    count = len(read_encoded(file).views)
    chosen = np.linspace(0, count - 1, min(views, count)).round().astype(int).tolist()
    return build_reference(read_views(file, chosen)).symmetries
