"""What a backbone gives, and the small protocol that every one follows.

A file beside this one offers a backbone by the name that `ONELOOK_BACKBONE` and `--backbone` call it:
`OFFERS: Mapping[str, Load] = {"name": function}`. Its test makes one, random and tiny, and calls the fixture `prove_backbone` on it
(tests/core/test_backbones.py).

Letters: V views, S input side in pixels, G patches a side, D token size.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from core.backbones.whitening import Whitening

if TYPE_CHECKING:
    import torch
    from torch import nn

Report = Callable[[str], None]
"""Told in one line what is being waited for."""


@dataclass(frozen=True, eq=False)
class Features:
    """Tokens of V square images."""

    patches: NDArray[np.float32]
    """Patch tokens of the backbone's matching layer, shape (V, G, G, D)."""
    cls: NDArray[np.float32]
    """[CLS] tokens of the last block after its LayerNorm, shape (V, D)."""
    attention: NDArray[np.float32]
    """Last block's attention from [CLS] to each patch, mean over heads, scaled to a maximum of 1, shape (V, G, G).

    Without `saliency` it alone tells the object: what exceeds `core.encode.EncoderConfig.attention_threshold` may be of it.
    """
    saliency: NDArray[np.float32] | None
    """A decoder's foreground probability in [0, 1], shape (V, S, S), where the backbone has one."""

    def part(self, rows: slice) -> Features:
        """Of some of the images."""
        saliency = None if self.saliency is None else self.saliency[rows]
        return Features(self.patches[rows], self.cls[rows], self.attention[rows], saliency)

    @staticmethod
    def joined(parts: Sequence[Features]) -> Features:
        """Of the images of all parts, one after the other."""
        patches, cls, attention = (np.concatenate([getattr(part, name) for part in parts]) for name in ("patches", "cls", "attention"))
        saliency = [part.saliency for part in parts if part.saliency is not None]
        return Features(patches, cls, attention, np.concatenate(saliency) if saliency else None)


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
    """Hash of all that changes tokens: weights, layer, preprocessing and statistics, but not the device (see `fingerprint`). Tokens of
    different ones cannot be compared."""

    def extract(self, images: NDArray[np.uint8]) -> Features:
        """Features of square RGB images, shape (V, S, S, 3), S a multiple of `patch_size`.

        With a fourth channel, shape (V, S, S, 4), patches whose pixels are 0 there take no part (`shown_patches`), which saves their time:
        they lend no context, and their tokens, attention and saliency are 0. An image without any patch has a [CLS] of 0.
        """
        ...


class Load(Protocol):
    """Makes a backbone: what a file of this folder offers by name."""

    def __call__(self, *, device: str, dtype: torch.dtype | None, report: Report) -> Backbone:
        """As `core.backbones.load_backbone`; a library of its own is imported in here.

        Raises Unavailable, naming the remedy, where weights or libraries are missing.
        """
        ...


def shown_patches(images: NDArray[np.uint8], patch_size: int) -> NDArray[np.bool_]:
    """Which patches are not transparent all over, shape (V, G²); all of them where there is no fourth channel."""
    grid = images.shape[1] // patch_size
    if images.shape[3] == 3:
        return np.ones((len(images), grid * grid), dtype=bool)
    cells = images[..., 3].reshape(len(images), grid, patch_size, grid, patch_size)
    return np.asarray(cells.any(axis=(2, 4)).reshape(len(images), -1))


def fingerprint(parts: Sequence[nn.Module], whitening: Whitening | None, preprocessing: str) -> str:
    """Of networks' weights, of statistics, and of a text that names what else there is to choose."""
    digest = hashlib.sha256(preprocessing.encode())
    for part in parts:
        for name, tensor in sorted(part.state_dict().items()):
            digest.update(name.encode())
            digest.update(tensor.cpu().numpy().tobytes())
    if whitening:
        digest.update(whitening.mean.tobytes() + whitening.matrix.tobytes())
    return digest.hexdigest()[:16]
