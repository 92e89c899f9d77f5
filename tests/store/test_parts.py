"""Parts of what an earlier version kept."""

from __future__ import annotations

import numpy as np
import pytest

from store.arrays import parts_from_blob, parts_to_blob
from store.parts import parts_from_patches

PATCHES = np.random.default_rng(0).normal(size=(3, 24, 8)).astype(np.float16)
"""Of three views."""


@pytest.mark.parametrize("parts", [1, 5])
def test_each_view_has_so_many_parts(parts: int) -> None:
    found = parts_from_blob(parts_from_patches(parts_to_blob(PATCHES), 3, 8, parts), 3, 8)
    assert found.shape == (3, parts, 8)
    if parts == 1:
        np.testing.assert_allclose(found[:, 0], PATCHES.astype(float).mean(axis=1), atol=2e-3)


@pytest.mark.parametrize("patches", [np.full((3, 24, 8), np.nan, np.float16), np.zeros((3, 0, 8), np.float16)])
def test_what_cannot_be_compared_is_refused(patches: np.ndarray) -> None:
    with pytest.raises(ValueError, match="^patches are not finite$"):
        parts_from_patches(parts_to_blob(patches), 3, 8, 5)
