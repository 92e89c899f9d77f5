"""Overlap of found and true foreground."""

from __future__ import annotations

import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks import isolation
from benchmarks.isolation import Overlap, found_mask, overlap, table_rows
from core.crop import Window
from core.errors import InvalidInput


def test_overlap_of_what_is_found_with_the_truth_by_hand() -> None:
    found, truth = np.zeros((4, 4), bool), np.zeros((4, 4), bool)
    found[:2], truth[1:] = True, True
    assert overlap(found, truth) == Overlap(iou=4 / 16, precision=4 / 8, recall=4 / 12)


def test_patches_are_painted_where_they_are() -> None:
    view = SimpleNamespace(grid=2, window=Window(2, 1, 4), cells=np.array([[0, 1], [1, 0]]))
    expected = np.zeros((6, 8), bool)
    expected[1:3, 4:6] = expected[3:5, 2:4] = True
    np.testing.assert_array_equal(found_mask(view, 6, 8), expected)


def test_a_window_may_stick_out_of_the_image() -> None:
    view = SimpleNamespace(grid=2, window=Window(-2, -2, 8), cells=np.array([[0, 0], [0, 1], [1, 0], [1, 1]]))
    assert found_mask(view, 4, 4).all()


def test_rows_are_means_over_views_then_categories() -> None:
    blind = Overlap(0.0, float("nan"), 0.0)
    cup, egg, everything = table_rows("attention", [("egg", Overlap(0.5, 1.0, 0.5)), ("cup", blind), ("cup", Overlap(1.0, 1.0, 1.0))])
    assert (cup.iou, cup.precision, cup.recall, cup.missed, cup.views) == (50, 100, 50, 50, 2)
    assert (egg.iou, egg.missed) == (50, 0)
    assert (everything.category, everything.iou, everything.missed, everything.views) == ("all", 50, 25, 3)


def test_an_object_on_black_is_found(recorded: Path, small_world: Any) -> None:
    small_world(isolation)
    *_, everything = isolation.run(recorded, None, ["saliency"], limit=None, backbone="colour")
    assert everything.iou > 85
    assert everything.views == 8


def test_the_limit_counts_objects_with_silhouettes(recorded: Path, small_world: Any) -> None:
    small_world(isolation)
    shutil.rmtree(recorded / "egg" / "large" / "mask_visib")
    *_, everything = isolation.run(recorded, None, ["saliency"], limit=1, backbone="colour")
    assert everything.views == 4


def test_silhouettes_that_are_no_views_are_none(recorded: Path) -> None:
    for mask in recorded.rglob("mask_visib/*.png"):
        mask.rename(mask.with_name(f"{mask.stem[:6]}.png"))
    with pytest.raises(InvalidInput, match="no view below .* has a silhouette"):
        isolation.run(recorded, None, isolation.SOURCES, limit=None, backbone="colour")
