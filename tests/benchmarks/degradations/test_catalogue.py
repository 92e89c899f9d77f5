"""All degradations together."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.degradations.catalogue import Degradation, catalogue
from core.views import Camera, View

NAMES = [each.name for each in catalogue([])]


def view() -> View:
    row, column = np.indices((330, 330))
    mask = (row - 165) ** 2 + (column - 160) ** 2 < 60**2
    rgb = np.random.default_rng(0).integers(20, 200, (330, 330, 3)).astype(np.uint8)
    K = np.array([[400.0, 0, 165], [0, 400, 165], [0, 0, 1]])
    return View(rgb, np.where(mask, 1, 2).astype(np.float32), Camera(K, np.eye(4)), mask)


def named(name: str) -> Degradation:
    return next(each for each in catalogue([view()]) if each.name == name)


@pytest.mark.parametrize("name", NAMES)
def test_every_strength_gives_a_valid_view_that_is_not_the_old_one(name: str) -> None:
    degradation = named(name)
    for strength in degradation.strengths:
        (worse,) = degradation.degrade([view()], strength, "egg/large", seed=0)
        worse.validate("view")
        same_picture = worse.size == view().size and bool((worse.rgb == view().rgb).all())
        assert same_picture != degradation.repaints
        same_depth = worse.size == view().size and bool((worse.depth_m == view().depth_m).all())
        same_camera = all((getattr(worse.camera, field) == getattr(view().camera, field)).all() for field in ("K", "world_from_camera"))
        assert not (same_picture and same_depth and same_camera)


@pytest.mark.parametrize("name", NAMES)
def test_a_seed_is_a_seed_and_every_view_has_chances_of_its_own(name: str) -> None:
    degradation = named(name)
    strength = degradation.strengths[1]
    first, again = (degradation.degrade([view(), view()], strength, "egg/large", seed=4) for _ in range(2))
    assert all(same(a, b) for a, b in zip(first, again, strict=True))
    other = degradation.degrade([view()], strength, "egg/small", seed=4)
    if name not in ("jpeg", "resolution"):  # these leave nothing to chance
        assert same(first[0], first[1]) == degradation.steady
        assert not same(first[0], other[0])


def same(a: View, b: View) -> bool:
    pairs = ((a.rgb, b.rgb), (a.depth_m, b.depth_m), (a.camera.K, b.camera.K), (a.camera.world_from_camera, b.camera.world_from_camera))
    return all(np.array_equal(one, other) for one, other in pairs)
