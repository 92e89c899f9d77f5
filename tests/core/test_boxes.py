"""Boxes of clouds whose box is known."""

from __future__ import annotations

import numpy as np
import pytest

from core.boxes import BOX_EDGES, cloud_extent_m, oriented_box, remove_outliers
from core.errors import NoObject
from core.sim3 import Sim3


def brick(count: int = 400) -> np.ndarray:
    return np.random.default_rng(0).uniform(-0.5, 0.5, (count, 3)) * np.array([0.6, 0.3, 0.1])


@pytest.mark.parametrize("count", [60, 2000])
def test_a_turned_brick_gets_its_own_box(count: int, moved: Sim3) -> None:
    box = oriented_box(moved.apply(brick(count)))
    assert np.allclose(np.sort(box.extent_m), np.array([0.1, 0.3, 0.6]) * moved.scale, rtol=0.25)
    assert np.allclose(box.world_from_object[:3, 3], moved.translation, atol=0.05)
    assert np.isclose(np.linalg.det(box.world_from_object[:3, :3]), 1)


def test_moving_the_box_moves_its_corners(moved: Sim3) -> None:
    box = oriented_box(brick())
    assert np.allclose(box.moved_by(moved).corners(), moved.apply(box.corners()))


def test_twelve_edges_of_one_axis_each() -> None:
    assert len(BOX_EDGES) == 12
    assert all(bin(first ^ second).count("1") == 1 for first, second in BOX_EDGES)


def test_stray_points_are_removed() -> None:
    cloud = np.concatenate([brick(), [[3.0, 3, 3], [-3, 2, 1]]])
    assert len(brick()) * 0.85 < len(remove_outliers(cloud)) <= len(brick())
    assert np.abs(remove_outliers(cloud)).max() < 1


def test_five_points_are_no_box() -> None:
    with pytest.raises(NoObject, match="only 5"):
        oriented_box(brick(5))


def test_a_flat_object_gets_a_thin_box() -> None:
    box = oriented_box(brick() * np.array([1, 1, 0]))
    assert np.allclose(np.sort(box.extent_m), [0, 0.3, 0.6], atol=0.02)


def test_extent_of_a_brick_is_its_diagonal() -> None:
    assert np.isclose(cloud_extent_m(brick(4000)), np.linalg.norm([0.6, 0.3, 0.1]), rtol=0.12)
