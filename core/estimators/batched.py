"""Many similarities at once, and Umeyama's closed form over a batch of small samples.

Letters: T transforms, S points a sample, N points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from core.sim3 import Sim3

RANK_TOLERANCE = 1e-4
"""Second singular value over the first below which a sample counts as collinear (single precision)."""


@dataclass(frozen=True, eq=False)
class Sim3Batch:
    """T transforms b_from_a."""

    scale: Tensor
    """Shape (T,)."""
    rotation: Tensor
    """Shape (T, 3, 3)."""
    translation: Tensor
    """Shape (T, 3)."""

    def __len__(self) -> int:
        return len(self.scale)

    def apply(self, points: Tensor) -> Tensor:
        """Points of frame a, shape (N, 3) or (T, N, 3), in frame b, shape (T, N, 3)."""
        return self.scale[:, None, None] * (points @ self.rotation.transpose(1, 2)) + self.translation[:, None]

    def select(self, index: Tensor | Sequence[int]) -> Sim3Batch:
        """The transforms at `index`."""
        chosen = torch.as_tensor(index)
        return Sim3Batch(self.scale[chosen], self.rotation[chosen], self.translation[chosen])

    def where(self, keep: Tensor, other: Sim3Batch) -> Sim3Batch:
        """These transforms where `keep`, shape (T,), else the other's."""
        return Sim3Batch(
            torch.where(keep, self.scale, other.scale),
            torch.where(keep[:, None, None], self.rotation, other.rotation),
            torch.where(keep[:, None], self.translation, other.translation),
        )

    def __getitem__(self, index: int) -> Sim3:
        return Sim3(float(self.scale[index]), self.rotation[index].double().numpy(), self.translation[index].double().numpy())

    @staticmethod
    def of(transforms: Sequence[Sim3]) -> Sim3Batch:
        """The transforms, in single precision."""
        rotation = np.stack([each.rotation for each in transforms])
        translation = np.stack([each.translation for each in transforms])
        scale = torch.tensor([each.scale for each in transforms]).float()
        return Sim3Batch(scale, torch.from_numpy(rotation).float(), torch.from_numpy(translation).float())

    @staticmethod
    def concatenate(batches: Sequence[Sim3Batch]) -> Sim3Batch:
        """All transforms of several batches."""
        return Sim3Batch(
            torch.cat([batch.scale for batch in batches]),
            torch.cat([batch.rotation for batch in batches]),
            torch.cat([batch.translation for batch in batches]),
        )


def umeyama_batch(source: Tensor, target: Tensor, weights: Tensor | None = None) -> tuple[Sim3Batch, Tensor]:
    """The similarities of least squares and whether each is determined, shape (T,), from points, shape (T, S, 3).

    Args:
        weights: non-negative, shape (T, S).
    """
    weight = torch.ones_like(source[..., 0]) if weights is None else weights
    weight = (weight / weight.sum(dim=-1, keepdim=True).clamp_min(1e-12)).unsqueeze(-1)
    source_mean, target_mean = (weight * source).sum(dim=1, keepdim=True), (weight * target).sum(dim=1, keepdim=True)
    source_centred, target_centred = source - source_mean, target - target_mean
    covariance = (weight * target_centred).transpose(1, 2) @ source_centred
    variance = (weight * source_centred**2).sum(dim=(1, 2))
    u, singular, vt = torch.linalg.svd(covariance)
    sign = torch.ones_like(singular)
    sign[:, 2] = torch.sign(torch.linalg.det(u @ vt))
    rotation = (u * sign.unsqueeze(1)) @ vt
    scale = (singular * sign).sum(dim=1) / variance.clamp_min(1e-12)
    translation = target_mean.squeeze(1) - scale[:, None] * (rotation @ source_mean.transpose(1, 2)).squeeze(-1)
    determined = (singular[:, 1] > RANK_TOLERANCE * singular[:, 0]) & (scale > 0) & (variance > 1e-12)
    return Sim3Batch(scale, rotation, translation), determined
