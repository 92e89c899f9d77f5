"""Things before the object and around it."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.degradations import scene
from core.errors import InvalidInput
from core.views import View


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(3)


def disc(colour: int = 200, depth_m: float = 1.0) -> View:
    """An object before a black wall at 3 m."""
    row, column = np.indices((200, 240))
    mask = (row - 100) ** 2 + (column - 120) ** 2 < 40**2
    rgb = np.where(mask[..., None], colour, 0) * np.ones(3)
    return View(rgb.astype(np.uint8), np.where(mask, depth_m, 3.0).astype(np.float32), mask=mask)


@pytest.mark.parametrize("share", [0.15, 0.6])
def test_an_occluder_hides_the_share_asked_for_and_is_nearer_than_the_object(share, rng) -> None:
    before = disc()
    after = scene.occlusion(before, share, rng)
    board = after.depth_m != before.depth_m
    assert (board & before.mask).sum() / before.mask.sum() == pytest.approx(share, abs=0.02)
    assert after.depth_m[board] == pytest.approx(scene.BEFORE)
    np.testing.assert_array_equal(after.mask, before.mask & ~board)
    np.testing.assert_array_equal(after.rgb[~board], before.rgb[~board])


def test_an_occluder_has_a_texture(rng) -> None:
    before = disc()
    after = scene.occlusion(before, 0.6, rng)
    assert after.rgb[after.depth_m != before.depth_m].std(axis=0).min() > 10


def test_things_around_hide_nothing_and_are_as_far_away(rng) -> None:
    before = disc()
    after = scene.clutter(before, 6, rng, [disc(90, 0.4), disc(140, 5.0)])
    np.testing.assert_array_equal(after.rgb[before.mask], before.rgb[before.mask])
    np.testing.assert_array_equal(after.depth_m[before.mask], before.depth_m[before.mask])
    new = (after.rgb != before.rgb).any(axis=2)
    assert set(np.unique(after.rgb[new])) == {90, 140}
    assert after.depth_m[new] == pytest.approx(1.0)
    assert new.sum() > before.mask.sum()


def test_more_things_stand_where_fewer_stood_and_elsewhere() -> None:
    few, many = (scene.clutter(disc(), count, np.random.default_rng(1), [disc(90)]).depth_m != disc().depth_m for count in (1, 4))
    assert (many | ~few).all()
    assert many.sum() > 2 * few.sum()


def test_the_silhouette_is_needed(rng) -> None:
    view = View(np.zeros((100, 100, 3), np.uint8))
    with pytest.raises(InvalidInput, match="mask"):
        scene.occlusion(view, 0.3, rng)
    with pytest.raises(InvalidInput, match="mask"):
        scene.clutter(view, 1, rng, [])
