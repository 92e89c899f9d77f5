"""Completion fills every hole; validity trusts only what was measured."""

from __future__ import annotations

import numpy as np

from core.depth import SAMPLES, cell_depth, complete, reliable


def test_measured_depth_is_kept_and_no_hole_is_left() -> None:
    depth = np.full((60, 60), 2.0, np.float32)
    depth[10:14, 10:14] = 0
    depth[:, 40:] = 0
    filled = complete(depth)
    assert (filled > 0).all()
    assert np.array_equal(filled[depth > 0], depth[depth > 0])
    assert np.allclose(filled[10:14, 10:14], 2.0)


def test_an_empty_corner_far_from_everything_gets_the_mean() -> None:
    depth = np.zeros((200, 200), np.float32)
    depth[:20, :20] = 1.0
    depth[:20, 20:40] = 3.0
    assert np.isclose(complete(depth)[199, 199], 2.0)


def test_a_silhouette_is_not_reliable_but_a_slope_is() -> None:
    depth = np.full((20, 20), 1.0, np.float32)
    depth[:, 10:] = 1.5
    trusted = reliable(depth)
    assert not trusted[:, 9:11].any()
    assert trusted[:, :8].all()
    assert reliable(np.tile(np.linspace(1, 1.2, 20, dtype=np.float32), (20, 1))).all()


def test_missing_depth_is_not_reliable() -> None:
    depth = np.full((9, 9), 1.0, np.float32)
    depth[4, 4] = 0
    assert not reliable(depth)[4, 4]
    assert reliable(depth)[0, 0]


def test_a_cell_takes_the_median_of_its_usable_samples() -> None:
    depth = np.full((2 * SAMPLES, 2 * SAMPLES), 1.0)
    use = np.ones(depth.shape, dtype=bool)
    depth[:2, :2] = 9.0
    use[SAMPLES:, SAMPLES:] = False
    found = cell_depth(depth, use, 2)
    assert found[0, 0] == 1.0
    assert np.isnan(found[1, 1])
