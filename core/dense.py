"""How well a transform lays one object on another: over all foreground points, geometry times appearance.

Letters: N reference points, Q target points, T transforms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from torch import Tensor

from core.affine9 import Affine9, fit_affine9
from core.boxes import cloud_extent_m
from core.estimators.batched import Sim3Batch, umeyama_batch
from core.sim3 import Sim3
from core.surface import Surface
from core.views import FloatArray

BATCH = 8
"""Transforms scored or matched at once: what lies between them stays in the processor's cache."""
OPPOSITE_PENALTY = 1e6
"""Log agreement that surfaces lose for each unit of cosine beyond OPPOSITE."""
LEAST_LOG = -60.0
"""Of a choice; smaller ones would be denormal numbers, which processors are slow with."""
OPPOSITE = -0.5
"""Cosine between normals below which surfaces face opposite ways: 120° apart, since objects of a kind differ and normals are noisy."""


@dataclass(frozen=True)
class DenseConfig:
    """Settings of the dense score and of its refinement; lengths are shares of the target's extent."""

    points: int = 400
    """Points drawn from each object."""
    sigma: float = 0.06
    """Distance at which a point's agreement has fallen to 1/e."""
    refine_sigmas: tuple[float, ...] = (0.15, 0.12, 0.12)
    """The same in each round of refinement. Wide: other objects of a category are of other shape, and surfaces laid close upon
    each other turn it away from what looks alike."""
    refine_power: float = 5.0
    """Exponent of the cosine in refinement, which makes appearance outweigh distance there."""
    temperature: float = 0.15
    """Softness of a point's choice among the other object's points, in units of log agreement."""


class DenseAgreement:
    """Two objects' points and descriptors, ready to score and refine transforms between them."""

    def __init__(
        self,
        reference: Surface,
        target: Surface,
        descriptors: tuple[Sequence[FloatArray], Sequence[FloatArray]],
        config: DenseConfig,
        seed: int,
    ) -> None:
        """`descriptors` are the unit descriptors of the surfaces' points, one array a view."""
        self.config = config
        self._drawn = (reference, reference.draw(config.points, seed)), (target, target.draw(config.points, seed + 1))
        self._reference, self._target = (_as_tensor(surface.points_m[drawn]) for surface, drawn in self._drawn)
        of_reference, of_target = (
            _as_tensor(np.concatenate(described)[drawn]) for described, (_, drawn) in zip(descriptors, self._drawn, strict=True)
        )
        self.extent_m = cloud_extent_m(self._target.numpy())
        self._middle = self._target.mean(dim=0)
        self._log_cosine = (of_reference @ of_target.T).clamp_min(1e-4).log()

    @cached_property
    def _faces(self) -> tuple[Tensor, Tensor]:
        """Where the drawn points of the reference and of the target face, shapes (N, 3) and (Q, 3); refinement does not ask."""
        of_reference, of_target = (_as_tensor(surface.normals[drawn]) for surface, drawn in self._drawn)
        return of_reference, of_target

    def score(self, transforms: Sim3Batch) -> Tensor:
        """Agreement in [0, 1], shape (T,): mean over points of max over the other object of exp(−(d/σ)²)·max(0, cosine),
        geometric mean of both directions. Surfaces that face opposite ways do not agree, however near: a thin thing face down does
        not lie on one face up."""
        faces_reference, faces_target = self._faces
        parts = []
        for start in range(0, len(transforms), BATCH):
            batch = transforms.select(range(start, min(start + BATCH, len(transforms))))
            opposite = (faces_reference @ batch.rotation.transpose(1, 2) @ faces_target.T).sub_(OPPOSITE).clamp_max_(0)
            log = self._log_agreement(batch.apply(self._reference), self.config.sigma, 1.0).add_(opposite, alpha=OPPOSITE_PENALTY)
            parts.append((log.amax(dim=2).exp().mean(dim=1) * log.amax(dim=1).exp().mean(dim=1)).sqrt())
        return torch.cat(parts)

    def refine(self, transforms: Sim3Batch) -> Sim3Batch:
        """Rounds of weighted least squares on soft matches in both directions."""
        for sigma in self.config.refine_sigmas:
            matches = [self._soft_matches(part, sigma) for part in torch.split(transforms.apply(self._reference), BATCH)]
            refined, determined = umeyama_batch(*(torch.cat(parts) for parts in zip(*matches)))
            transforms = refined.where(determined, transforms)
        return transforms

    def stretch(self, transform: Sim3, world_from_object: Sim3) -> Affine9:
        """target_from_object: the same with a scale for each axis of the object's frame, from a transform that is nearly right.

        `world_from_object` is rigid. Raises NoPose where the matches do not determine it.
        """
        stretched = Affine9.from_similarity(transform @ world_from_object)
        points = world_from_object.inverse().apply(self._reference.double().numpy())
        for sigma in self.config.refine_sigmas:
            placed = torch.from_numpy(stretched.apply(points)).float()
            source, target, weights = (each[0].double().numpy() for each in self._soft_matches(placed[None], sigma))
            stretched = fit_affine9(world_from_object.inverse().apply(source), target, weights)
        return stretched

    def _soft_matches(self, placed: Tensor, sigma: float) -> tuple[Tensor, Tensor, Tensor]:
        """Points of the reference and of the target, (T, N + Q, 3), and weights, for reference points placed as in `_log_agreement`."""
        log = self._log_agreement(placed, sigma, self.config.refine_power)
        best = log.amax(dim=2), log.amax(dim=1)
        # One exponential serves both directions; what it rounds to nothing has no weight either.
        choice = log.sub_(best[0].amax(dim=1)[:, None, None]).div_(self.config.temperature).clamp_min_(LEAST_LOG).exp_()
        aims = (choice @ self._target) / choice.sum(dim=2, keepdim=True).clamp_min(1e-30)
        starts = (choice.transpose(1, 2) @ self._reference) / choice.sum(dim=1).unsqueeze(2).clamp_min(1e-30)
        count = len(placed)
        source = torch.cat([self._reference.expand(count, -1, -1), starts], dim=1)
        return source, torch.cat([aims, self._target.expand(count, -1, -1)], dim=1), torch.cat(best, dim=1).exp()

    def _log_agreement(self, placed: Tensor, sigma: float, power: float) -> Tensor:
        """Log of exp(−(d/σ)²)·max(0, cosine)^power, shape (T, N, Q), for reference points placed in the target's world, (T, N, 3)."""
        unit_m = sigma * self.extent_m
        placed, target = (placed - self._middle) / unit_m, (self._target - self._middle) / unit_m
        ones = torch.ones_like(placed[..., :1])
        # −(d/σ)² = 2 p·q − p² − q² is one product of vectors of five
        rows = torch.cat([2 * placed, -(placed**2).sum(dim=-1, keepdim=True), -ones], dim=-1)
        columns = torch.cat([target, torch.ones(len(target), 1), (target**2).sum(dim=-1, keepdim=True)], dim=-1).T
        return (rows @ columns).add_(self._log_cosine, alpha=power)


def _as_tensor(values: FloatArray) -> Tensor:
    return torch.from_numpy(values).float()
