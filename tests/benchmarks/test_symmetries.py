"""Claims of symmetry against what is declared."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks import symmetries
from benchmarks.symmetries import SymmetryRow, judge, table_rows
from clients.datasets.folders import Sequence
from core.errors import InvalidInput
from core.sim3 import Sim3
from core.views import FloatArray

TILTED = Rotation.from_euler("xyz", [70, 20, 130], degrees=True).as_matrix()


def turns(*angles: float) -> FloatArray:
    """About the model's z axis."""
    return np.array([Rotation.from_euler("z", angle, degrees=True).as_matrix() for angle in angles]).reshape(-1, 3, 3)


@pytest.mark.parametrize(
    ("declared", "claimed", "found", "complete", "false"),
    [
        ((), (), 0, 0, 0),
        ((), (180,), 0, 0, 1),
        ((180,), (), 0, 0, 0),
        ((180,), (176,), 1, 1, 0),
        ((90, 180, 270), (180,), 1, 0, 0),
        ((90, 180, 270), (120, 240), 0, 0, 1),
        (range(5, 360, 5), range(30, 360, 30), 1, 1, 0),
    ],
)
def test_claims_in_any_world_are_compared_with_the_model(declared: Any, claimed: Any, found: int, complete: int, false: int) -> None:
    sequence = Sequence(Path(), "cup", "cup_1", (), Sim3(0.3, TILTED, np.ones(3)), tuple(turns(*declared)))
    row = judge(sequence, TILTED @ turns(*claimed) @ TILTED.T)
    assert row == SymmetryRow("cup", 1, int(len(declared) > 0), found, complete, false)


def test_rows_are_sums() -> None:
    cup, egg, everything = table_rows(
        [SymmetryRow("egg", 1, 1, 1, 0, 0), SymmetryRow("cup", 1, 0, 0, 0, 1), SymmetryRow("cup", 1, 0, 0, 0, 0)]
    )
    assert (cup, egg) == (SymmetryRow("cup", 2, 0, 0, 0, 1), SymmetryRow("egg", 1, 1, 1, 0, 0))
    assert everything == SymmetryRow("all", 3, 1, 1, 0, 1)


def test_an_object_painted_by_place_has_none(recorded: Path, tmp_path: Path, small_world: Any) -> None:
    small_world(symmetries)
    *_, everything = symmetries.run(recorded, tmp_path / "rows.json", views=10, limit=None, backbone="colour")
    assert (everything.objects > 0, everything.symmetric, everything.false) == (True, 0, 0)
    assert (tmp_path / "rows.json").exists()


def test_the_limit_counts_objects_that_can_be_judged(recorded: Path, small_world: Any) -> None:
    small_world(symmetries)
    (recorded / "egg" / "large" / "scene_gt.json").unlink()
    *_, everything = symmetries.run(recorded, None, views=10, limit=1, backbone="colour")
    assert everything.objects == 1


def test_a_ground_truth_is_needed(tmp_path: Path, recorded: Path) -> None:
    for file in recorded.rglob("scene_gt.json"):
        file.unlink()
    with pytest.raises(InvalidInput, match="scene_gt"):
        symmetries.run(recorded, None, views=10, limit=None, backbone="colour")
