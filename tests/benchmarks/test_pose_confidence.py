"""Reliability is measured in bins of as many poses each."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.pose_confidence import BINS, reliability


def test_a_kept_promise_is_on_the_diagonal() -> None:
    rng = np.random.default_rng(0)
    confidence = rng.random(5000)
    rows = reliability(confidence, rng.random(5000) < confidence)
    assert [row.poses for row in rows] == [1000] * BINS
    assert all(row.right == pytest.approx(row.confidence, abs=5) for row in rows)
    assert all(row.lowest <= row.confidence <= row.highest for row in rows)


def test_overconfidence_shows() -> None:
    (*_, top) = reliability(np.full(100, 0.9), np.arange(100) % 2 == 0)
    assert top.confidence == pytest.approx(90)
    assert 40 <= top.right <= 60


def test_fewer_poses_than_bins() -> None:
    assert sum(row.poses for row in reliability(np.array([0.2, 0.8]), np.array([False, True]))) == 2
