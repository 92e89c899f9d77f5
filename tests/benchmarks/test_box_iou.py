"""Intersections over unions known by hand."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.box_iou import Parallelepiped, box_iou
from core.sim3 import Sim3

CUBE = Parallelepiped(np.eye(4))


def moved(x: float = 0.0, scale: float = 1.0, degrees: float = 0.0) -> Parallelepiped:
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    return CUBE.carried_by(Sim3(scale, turn, np.array([x, 0.0, 0.0])).as_matrix())


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        (CUBE, 1.0),
        (moved(x=0.5), 1 / 3),
        (moved(x=2.0), 0.0),
        (moved(scale=2.0), 1 / 8),
        (moved(degrees=90), 1.0),
        (moved(degrees=45), 2 * (2**0.5 - 1) / (2 - 2 * (2**0.5 - 1))),
    ],
)
def test_known_answers_both_ways(other: Parallelepiped, expected: float) -> None:
    assert box_iou(CUBE, other) == pytest.approx(expected, abs=0.03)
    assert box_iou(other, CUBE) == pytest.approx(expected, abs=0.03)


def test_a_sheared_box_keeps_its_volume() -> None:
    shear = np.eye(4)
    shear[0, 1] = 1.0
    assert CUBE.carried_by(shear).volume == pytest.approx(1)
    assert box_iou(CUBE, CUBE.carried_by(shear)) == pytest.approx(0.75 / 1.25, abs=0.03)


def test_around_points_touches_the_outermost() -> None:
    box = Parallelepiped.around(np.array([[0.0, 0, 0], [2, 1, 4], [1, 1, 1]]))
    assert box.volume == pytest.approx(8)
    assert box.world_from_cube[:3, 3].tolist() == [1, 0.5, 2]


def test_a_flat_box_shares_nothing() -> None:
    assert box_iou(CUBE, CUBE.carried_by(np.diag([1.0, 1, 0, 1]))) == 0
