"""The support votes for what stands on it."""

from __future__ import annotations

import numpy as np

from core.foreground import fit_plane, otsu_threshold, vote_by_support


def scene() -> tuple[np.ndarray, np.ndarray]:
    """A wall 1 m away facing the camera with a box 0.2 m nearer in the middle, 64×64 pixels, 1 m wide."""
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 64), np.linspace(-0.5, 0.5, 64))
    inside = (np.abs(x) < 0.2) & (np.abs(y) < 0.2)
    return np.stack([x, y, np.where(inside, 0.8, 1.0)], axis=-1), inside


def test_a_plane_is_found_among_outliers() -> None:
    points, _ = scene()
    normal, origin = fit_plane(points.reshape(-1, 3), 0.01)
    assert np.allclose(normal, [0, 0, -1], atol=1e-6)
    assert np.isclose(origin[2], 1.0)


def test_unsure_parts_of_the_object_are_raised_over_the_support() -> None:
    points, inside = scene()
    soft = np.where(inside, 0.45, 0.4)
    soft[28:36, 28:36] = 0.95
    voted = vote_by_support(soft, points, np.ones_like(inside), 1.0)
    middle = inside & (np.abs(points[..., 0]) < 0.15) & (np.abs(points[..., 1]) < 0.15)
    assert voted[middle].min() > 0.7
    assert voted[~inside].mean() < 0.2


def test_a_wall_far_behind_is_not_raised_though_it_is_above_the_support() -> None:
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 64), np.linspace(-0.3, 0.5, 64))
    table, inside = y > 0.2, (np.abs(x) < 0.15) & (y > -0.05) & (y < 0.2)
    depth = np.where(table, 0.2 / np.maximum(y, 0.2), np.where(inside, 1.0, 3.0))
    points = np.stack([x * depth, y * depth, depth], axis=-1)
    wall = ~table & ~inside
    soft = np.where(inside, 0.6, 0.3)
    voted = vote_by_support(soft, points, np.ones_like(inside), 1.0)
    assert voted[inside].mean() > 0.8
    assert voted[wall].mean() < 0.35


def test_without_usable_depth_nothing_changes() -> None:
    points, inside = scene()
    soft = inside.astype(float)
    assert np.array_equal(vote_by_support(soft, points, np.zeros_like(inside), 1.0), soft)


def test_otsu_splits_a_faint_object_from_its_background() -> None:
    soft = np.full((20, 20), 0.1)
    soft[5:15, 5:15] = 0.3
    assert ((soft > otsu_threshold(soft)) == (soft == 0.3)).all()
