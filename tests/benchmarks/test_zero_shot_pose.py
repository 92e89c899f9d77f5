"""The recipe that ours is timed against does its work: it finds the pose."""

from __future__ import annotations

import numpy as np

from benchmarks import zero_shot_pose
from core.matched_pair import MatchedPair
from core.reference import build_reference
from core.sim3 import Sim3
from tests.core.conftest import PaintedObject


def test_the_recipe_finds_the_pose(painted: PaintedObject, moved: Sim3) -> None:
    pair = MatchedPair(build_reference(painted.encode(4, Sim3.identity())), painted.encode(4, moved), None, 50, "cyclical")
    found = zero_shot_pose.solve(pair, 0.02, seed=0)
    assert np.allclose(found, moved.as_matrix(), atol=0.05)


def test_bare_products_are_the_cosines_of_all_patches(painted: PaintedObject, moved: Sim3) -> None:
    pair = MatchedPair(build_reference(painted.encode(2, Sim3.identity())), painted.encode(3, moved), None, 50, "cyclical")
    found = zero_shot_pose.bare_products(*pair.descriptors)
    assert found.shape == (sum(map(len, pair.descriptors[0])), sum(map(len, pair.descriptors[1])))
    assert np.isclose(found[0, 0], pair.descriptors[0][0][0] @ pair.descriptors[1][0][0], atol=1e-5)
