"""View pairs and their agreement."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from core.sim3 import Sim3, rotation_angle_deg
from core.viewpoints import best_reference_per_target, consensus, mean_rotation, near_their_mean, relative_rotations, view_agreement

from .conftest import PaintedObject


def around_z(*degrees: float) -> np.ndarray:
    return np.asarray(Rotation.from_euler("z", np.array(degrees)[:, None], degrees=True).as_matrix())


def test_best_reference_is_the_column_maximum() -> None:
    assert best_reference_per_target(np.array([[1.0, 5], [3, 2]])) == [(1, 0), (0, 1)]


def test_the_largest_agreeing_set_wins() -> None:
    assert consensus(around_z(0, 10, 20, 120, 130, 200), np.ones(6), 30, seed=0).tolist() == [True, True, True, False, False, False]


def test_of_sets_as_large_the_more_similar_wins() -> None:
    rotations = around_z(0, 10, 180, 190)
    assert consensus(rotations, np.array([20.0, 20, 30, 30]), 30, seed=0).tolist() == [False, False, True, True]
    assert consensus(rotations, np.array([30.0, 30, 20, 20]), 30, seed=0).tolist() == [True, True, False, False]


def test_similarity_never_outvotes_size() -> None:
    assert consensus(around_z(0, 10, 20, 180), np.array([1.0, 1, 1, 99]), 30, seed=0).tolist() == [True, True, True, False]


def test_a_tighter_angle_drops_the_edges() -> None:
    kept = consensus(around_z(0, 5, 40), np.ones(3), 15, seed=0)
    assert kept.tolist() == [True, True, False]


def test_the_same_seed_gives_the_same_consensus() -> None:
    rotations = Rotation.random(12, rng=3).as_matrix()
    assert np.array_equal(consensus(rotations, np.ones(12), 40, 7), consensus(rotations, np.ones(12), 40, 7))


def test_views_from_the_same_side_give_the_true_rotation(painted: PaintedObject, moved: Sim3) -> None:
    reference, target = painted.encode(4), painted.encode(4, moved)
    relative = relative_rotations(reference.views, target.views)
    same_side = relative[np.arange(4), np.arange(4)]
    assert rotation_angle_deg(same_side, moved.rotation).max() < 3


def test_a_rotation_that_joins_similar_views_agrees_more_than_others(painted: PaintedObject, moved: Sim3) -> None:
    relative = relative_rotations(painted.encode(4).views, painted.encode(4, moved).views)
    half_turn = moved.rotation @ around_z(180)[0]
    right, wrong = view_agreement(np.stack([moved.rotation, half_turn]), relative, np.eye(4) + 1, 30)
    assert right > 1
    assert wrong < 0


def test_the_mean_rotation_is_between() -> None:
    assert rotation_angle_deg(mean_rotation(around_z(10, 30)), around_z(20)[0]) < 1e-4


def test_the_farthest_from_the_mean_leaves_first() -> None:
    assert near_their_mean(around_z(0, 10, 20, 170), 30).tolist() == [True, True, True, False]
    assert near_their_mean(around_z(0, 10), 30).all()


def test_a_reference_view_that_is_like_every_target_view_speaks_for_no_rotation(painted: PaintedObject, moved: Sim3) -> None:
    relative = relative_rotations(painted.encode(4).views, painted.encode(4, moved).views)
    half_turn = moved.rotation @ around_z(180)[0]
    lit = 1 + np.eye(4) + np.array([0.0, 5.0, 0.0, 0.0])[:, None]
    right, wrong = view_agreement(np.stack([moved.rotation, half_turn]), relative, lit, 30)
    assert right > wrong + 0.1


def test_views_that_are_all_alike_say_nothing(painted: PaintedObject) -> None:
    relative = relative_rotations(painted.encode(3).views, painted.encode(2).views)
    assert np.allclose(view_agreement(around_z(0, 90), relative, np.ones((3, 2)), 30), 0)
