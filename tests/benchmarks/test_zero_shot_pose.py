"""The recipe that ours is timed against does its work: it finds the pose."""

from __future__ import annotations

import numpy as np

from benchmarks import zero_shot_pose
from core.matched_pair import MatchedPair
from core.reference import build_reference
from core.sim3 import Sim3
from tests.core.conftest import PaintedObject

MOVED = Sim3(1.2, np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.array([0.1, 0.2, 0.3]))


def matched(reference_views: int, target_views: int) -> MatchedPair:
    thing = PaintedObject()
    return MatchedPair(
        build_reference(thing.encode(reference_views, Sim3.identity())), thing.encode(target_views, MOVED), None, 50, "cyclical"
    )


def test_the_recipe_finds_the_pose() -> None:
    assert np.allclose(zero_shot_pose.solve(matched(4, 4), 0.02, seed=0), MOVED.as_matrix(), atol=0.05)


def test_bare_products_are_the_cosines_of_all_patches() -> None:
    pair = matched(2, 3)
    found = zero_shot_pose.bare_products(*pair.descriptors)
    assert found.shape == (sum(map(len, pair.descriptors[0])), sum(map(len, pair.descriptors[1])))
    assert np.isclose(found[0, 0], pair.descriptors[0][0][0] @ pair.descriptors[1][0][0], atol=1e-5)
