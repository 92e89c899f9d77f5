"""View pairs and their agreement."""

from __future__ import annotations

import numpy as np
from core.sim3 import Sim3, rotation_angle_deg
from core.viewpoints import best_reference_per_target, consensus, mean_rotation, relative_rotations
from scipy.spatial.transform import Rotation

from .conftest import PaintedObject


def around_z(*degrees: float) -> np.ndarray:
    return np.asarray(Rotation.from_euler("z", np.array(degrees)[:, None], degrees=True).as_matrix())


def test_best_reference_is_the_column_maximum() -> None:
    assert best_reference_per_target(np.array([[1.0, 5], [3, 2]])) == [(1, 0), (0, 1)]


def test_the_largest_agreeing_set_wins() -> None:
    assert consensus(around_z(0, 10, 20, 120, 130, 200), 30, seed=0).tolist() == [True, True, True, False, False, False]


def test_a_tighter_angle_drops_the_edges() -> None:
    kept = consensus(around_z(0, 5, 40), 15, seed=0)
    assert kept.tolist() == [True, True, False]


def test_the_same_seed_gives_the_same_consensus() -> None:
    rotations = Rotation.random(12, rng=3).as_matrix()
    assert np.array_equal(consensus(rotations, 40, 7), consensus(rotations, 40, 7))


def test_views_from_the_same_side_give_the_true_rotation(painted: PaintedObject, moved: Sim3) -> None:
    reference, target = painted.encode(4, Sim3.identity()), painted.encode(4, moved)
    relative = relative_rotations(reference.views, target.views)
    same_side = relative[np.arange(4), np.arange(4)]
    assert rotation_angle_deg(same_side, moved.rotation).max() < 3


def test_mean_rotation() -> None:
    assert rotation_angle_deg(mean_rotation(around_z(10, 30)), around_z(20)[0]) < 1e-4
