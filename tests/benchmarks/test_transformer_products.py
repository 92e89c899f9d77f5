"""The products of a transformer are counted once an image, however images are put together."""

from __future__ import annotations

import pytest
import torch

from benchmarks import transformer_products
from core.backbones.dino import CACHED_TOKENS


@pytest.mark.parametrize(("grid", "images"), [(16, 10), (28, 10), (28, 1)])
def test_every_image_goes_through_each_layer_once(grid: int, images: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rows: list[int] = []
    monkeypatch.setattr(transformer_products, "linear", lambda tokens, weights: rows.append(len(tokens)))
    transformer_products.bare_products(grid, 64, images, "cpu", torch.float32)
    layers = 6 * transformer_products.BLOCKS
    assert sum(rows) == layers * images * (1 + grid * grid)
    assert max(rows) <= CACHED_TOKENS
