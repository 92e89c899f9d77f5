"""What a backbone gives, and the small protocol that every one follows.

Letters: V views, S input side in pixels, G patches a side, D token size.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from core.backbones.whitening import Whitening


@dataclass(frozen=True, eq=False)
class Features:
    """Tokens of V square images."""

    patches: NDArray[np.float32]
    """Patch tokens of the backbone's matching layer, shape (V, G, G, D)."""
    cls: NDArray[np.float32]
    """[CLS] tokens of the last block after its LayerNorm, shape (V, D)."""
    attention: NDArray[np.float32]
    """Last block's attention from [CLS] to each patch, mean over heads, scaled to a maximum of 1, shape (V, G, G)."""
    saliency: NDArray[np.float32] | None
    """A decoder's foreground probability in [0, 1], shape (V, S, S), where the backbone has one."""


class Backbone(Protocol):
    """A frozen ViT. `extract` is deterministic and has no state."""

    name: str
    patch_size: int
    """Pixels a patch side."""
    dim: int
    """Token size D."""
    has_saliency: bool
    """Whether `Features.saliency` is given."""
    whitening: Whitening | None
    """Statistics of its patch tokens, where it has them."""
    fingerprint: str
    """Hash of weights, layer and preprocessing: tokens of different fingerprints cannot be compared."""

    def extract(self, images: NDArray[np.uint8]) -> Features:
        """Features of square RGB images, shape (V, S, S, 3), S a multiple of `patch_size`.

        With a fourth channel, shape (V, S, S, 4), patches whose pixels are 0 there take no part, which saves their time: they lend
        no context, and their tokens, attention and saliency are 0. An image without any patch has a [CLS] of 0.
        """
        ...
