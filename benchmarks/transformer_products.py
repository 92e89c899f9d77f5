"""What no way to run a vision transformer goes below on this machine: its matrix products alone, on tensors of their shapes.

Nothing between the products is computed (norms, softmax, activations, residuals), nor the saliency decoder.
"""

from __future__ import annotations

import torch
from torch.nn.functional import linear

from core.backbones.dino import passes

BLOCKS = 12
HEAD_DIM = 64
"""Size of an attention head's tokens."""
WIDENING = 4
"""Of the two layers between attention and attention. All three are the sizes of every ViT-S and ViT-B."""


@torch.inference_mode()
def bare_products(grid: int, dim: int, images: int, device: str, dtype: torch.dtype) -> None:
    """The products for `images` of `grid` by `grid` patches and a [CLS], as many at a time as the backbone takes."""
    tokens = 1 + grid * grid
    for part in passes(images, tokens, device):
        _products(len(part), tokens, dim, device, dtype)


def _products(images: int, tokens: int, dim: int, device: str, dtype: torch.dtype) -> None:
    rows = torch.zeros(images * tokens, dim, device=device, dtype=dtype)
    wide = torch.zeros(images * tokens, WIDENING * dim, device=device, dtype=dtype)
    square, widen = (torch.zeros(factor * dim, dim, device=device, dtype=dtype) for factor in (1, WIDENING))
    narrow = torch.zeros(dim, WIDENING * dim, device=device, dtype=dtype)
    heads = torch.zeros(images * dim // HEAD_DIM, tokens, HEAD_DIM, device=device, dtype=dtype)
    for _ in range(BLOCKS):
        for _ in range(4):  # query, key, value, and what goes out
            linear(rows, square)
        (heads @ heads.transpose(1, 2)) @ heads
        linear(rows, widen)
        linear(wide, narrow)
