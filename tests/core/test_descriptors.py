"""PCA finds the directions of largest variance of the reference alone."""

from __future__ import annotations

import numpy as np
import pytest

from core.descriptors import PcaBasis, component_count, unit
from core.errors import InvalidInput


def test_the_first_component_is_the_stretched_axis() -> None:
    tokens = np.random.default_rng(0).normal(size=(500, 4)).astype(np.float32) * np.array([1, 10, 1, 3], np.float32) + 7
    basis = PcaBasis.fit(tokens, 2)
    assert np.allclose(np.abs(basis.components), [[0, 1, 0, 0], [0, 0, 0, 1]], atol=0.05)
    assert basis.explained[0] > 0.8
    assert np.allclose(basis.project(tokens).mean(axis=0), 0, atol=1e-3)


def test_all_components_keep_all_distances() -> None:
    tokens = np.random.default_rng(1).normal(size=(50, 6)).astype(np.float32)
    projected = PcaBasis.fit(tokens, 6).project(tokens)
    assert np.allclose(np.linalg.norm(projected[0] - projected[1]), np.linalg.norm(tokens[0] - tokens[1]), rtol=1e-4)


def test_fewer_tokens_than_components() -> None:
    assert PcaBasis.fit(np.eye(3, 8, dtype=np.float32), 32).components.shape == (3, 8)


def test_unit_leaves_zero_alone() -> None:
    assert np.array_equal(unit(np.array([[0.0, 0.0], [3.0, 4.0]], np.float32)), np.array([[0, 0], [0.6, 0.8]], np.float32))


def test_the_size_of_a_token_asks_for_whole_tokens() -> None:
    assert [component_count(dims, 384) for dims in (32, 384, None)] == [32, None, None]


def test_more_components_than_are_kept_are_refused() -> None:
    with pytest.raises(InvalidInput, match="^dims: expected 1 to 64, or 384 for whole tokens, found 65$"):
        component_count(65, 384)
