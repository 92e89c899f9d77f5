"""Many similarities at once, and their least-squares fits in closed form, without a decomposition for each.

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
NEWTON_STEPS = 3
"""Each doubles the digits of a root that is right to about eight."""


@dataclass(frozen=True, eq=False)
class Sim3Batch:
    """T transforms b_from_a."""

    scale: Tensor
    """Shape (T,)."""
    rotation: Tensor
    """Shape (T, 3, 3)."""
    translation: Tensor
    """Shape (T, 3)."""

    @staticmethod
    def empty() -> Sim3Batch:
        """None at all."""
        return Sim3Batch(torch.zeros(0), torch.zeros(0, 3, 3), torch.zeros(0, 3))

    def __len__(self) -> int:
        return len(self.scale)

    def apply(self, points: Tensor) -> Tensor:
        """Points of frame a, shape (N, 3) or (T, N, 3), in frame b, shape (T, N, 3)."""
        return self.scale[:, None, None] * (points @ self.rotation.transpose(1, 2)) + self.translation[:, None]

    def squared_errors(self, source: Tensor, target: Tensor) -> Tensor:
        """|b_from_a · source − target|² of corresponding points, shapes (N, 3), in one product, shape (T, N).

        Multiplied out it is linear in what a pair of points is and in what a transform is. In double precision, since terms cancel.
        """
        scale, rotation, translation = (each.double() for each in (self.scale, self.rotation, self.translation))
        source, target = source.double(), target.double()
        turned = scale[:, None, None] * rotation
        of_transform = [
            (scale**2)[:, None],
            torch.ones_like(scale)[:, None],
            2 * (turned.transpose(1, 2) @ translation[:, :, None])[:, :, 0],
            -2 * translation,
            -2 * turned.flatten(1),
            (translation**2).sum(dim=1, keepdim=True),
        ]
        of_points = [
            (source**2).sum(dim=1, keepdim=True),
            (target**2).sum(dim=1, keepdim=True),
            source,
            target,
            (target[:, :, None] * source[:, None, :]).flatten(1),
            torch.ones_like(source[:, :1]),
        ]
        return torch.cat(of_transform, dim=1) @ torch.cat(of_points, dim=1).T

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
    covariance = ((weight * source_centred).transpose(1, 2) @ target_centred).double()
    variance = (weight * source_centred**2).sum(dim=(1, 2)).double()
    size = torch.linalg.norm(covariance, dim=(1, 2)).clamp_min(1e-30)
    covariance = covariance / size[:, None, None]
    singular = _singular_values(covariance)
    overlap = (singular * torch.stack([torch.ones_like(size), torch.ones_like(size), _determinant(covariance).sign()], dim=1)).sum(dim=1)
    rotation, overlap = _best_rotations(covariance, overlap)
    scale = overlap * size / variance.clamp_min(1e-12)
    determined = (singular[:, 1] > RANK_TOLERANCE * singular[:, 0]) & (scale > 0) & (variance > 1e-12) & (size > 1e-30)
    rotation, scale = rotation.to(source.dtype), scale.to(source.dtype)
    translation = target_mean.squeeze(1) - scale[:, None] * (rotation @ source_mean.transpose(1, 2)).squeeze(-1)
    return Sim3Batch(scale, rotation, translation), determined


def _singular_values(matrices: Tensor) -> Tensor:
    """Of 3×3 matrices, largest first, shape (T, 3): roots of the characteristic cubic by cosines (Smith 1961), good to eight digits."""
    squares = matrices.transpose(1, 2) @ matrices
    mean = squares.diagonal(dim1=1, dim2=2).sum(dim=1) / 3
    centred = squares - mean[:, None, None] * torch.eye(3, dtype=matrices.dtype)
    radius = ((centred**2).sum(dim=(1, 2)) / 6).sqrt()
    angle = (_determinant(centred) / (2 * radius**3).clamp_min(1e-30)).clamp(-1, 1).acos() / 3
    first, third = (mean + 2 * radius * torch.cos(angle + turn) for turn in (0.0, 2 * torch.pi / 3))
    return torch.stack([first, 3 * mean - first - third, third], dim=1).clamp_min(0).sqrt()


def _best_rotations(covariance: Tensor, overlap: Tensor) -> tuple[Tensor, Tensor]:
    """The rotations, shape (T, 3, 3), of largest trace(rotation · covariance), and that trace, shape (T,), by Horn's quaternions (1987).

    The trace is the largest root of the characteristic polynomial of his matrix; near it already, shape (T,), it is made exact by
    Newton's steps. The eigenvector is a row of the product of the other factors (Theobald 2005). Of covariances source · target with
    norm 1, in double precision.
    """
    horn = (covariance.reshape(-1, 9) @ HORN).reshape(-1, 4, 4)
    square = horn @ horn
    c2, c1 = -2.0, -8.0 * _determinant(covariance)
    c0 = (2 * c2**2 - (square**2).sum(dim=(1, 2))) / 4
    root = overlap
    for _ in range(NEWTON_STEPS):
        value = ((root**2 + c2) * root + c1) * root + c0
        slope = (4 * root**2 + 2 * c2) * root + c1
        root = root - value / torch.where(slope.abs() > 1e-12, slope, torch.inf)
    linear, constant = (each[:, None, None] * torch.eye(4, dtype=horn.dtype) for each in (root**2 + c2, (root**2 + c2) * root + c1))
    product = (square + root[:, None, None] * horn + linear) @ horn + constant
    longest = product.diagonal(dim1=1, dim2=2).argmax(dim=1)
    quaternion = product[torch.arange(len(product)), longest]
    quaternion = quaternion / torch.linalg.norm(quaternion, dim=1, keepdim=True).clamp_min(1e-30)
    w, x, y, z = quaternion.unbind(dim=1)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return torch.stack([torch.stack(row, dim=1) for row in rows], dim=1), root


def _determinant(matrices: Tensor) -> Tensor:
    """Of 3×3 matrices, shape (T,)."""
    return (matrices[:, 0] * torch.linalg.cross(matrices[:, 1], matrices[:, 2])).sum(dim=1)


def _horn() -> Tensor:
    """The linear map from a covariance's nine entries to Horn's symmetric 4×4 matrix, shape (9, 16)."""
    entries = torch.eye(9, dtype=torch.float64).reshape(9, 3, 3)
    trace = entries.diagonal(dim1=1, dim2=2).sum(dim=1)
    axis = torch.stack(
        [entries[:, 1, 2] - entries[:, 2, 1], entries[:, 2, 0] - entries[:, 0, 2], entries[:, 0, 1] - entries[:, 1, 0]], dim=1
    )
    map_ = torch.zeros(9, 4, 4, dtype=torch.float64)
    map_[:, 0, 0] = trace
    map_[:, 0, 1:] = map_[:, 1:, 0] = axis
    map_[:, 1:, 1:] = entries + entries.transpose(1, 2) - trace[:, None, None] * torch.eye(3, dtype=torch.float64)
    return map_.reshape(9, 16)


HORN = _horn()
