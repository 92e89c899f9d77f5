"""Many similarities at once: Umeyama's closed form over a batch of small samples.

Letters: T trials, S points a sample.
"""

from __future__ import annotations

import torch
from torch import Tensor


def umeyama_batch(source: Tensor, target: Tensor, weights: Tensor | None = None) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """scale (T,), rotation (T, 3, 3), translation (T, 3) and whether each is determined (T,), from shapes (T, S, 3).

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
    determined = (singular[:, 1] > 1e-4 * singular[:, 0]) & (scale > 0) & (variance > 1e-12)
    return scale, rotation, translation, determined
