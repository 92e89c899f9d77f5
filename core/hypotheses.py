"""Many guesses of the transform, so that one of them is right: pooled, by consensus cluster, by view pair, by alignment.

Letters: T transforms, S symmetries.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

from core.boxes import cloud_extent_m
from core.estimators.base import MIN_CORRESPONDENCES
from core.estimators.batched import Sim3Batch, umeyama_batch
from core.estimators.ransac import sample
from core.matched_pair import MatchedPair, Pairs
from core.matches import end_points, pool
from core.surface import Surface
from core.viewpoints import angles_deg, consensus
from core.views import FloatArray


@dataclass(frozen=True)
class HypothesesConfig:
    """How many guesses of each kind."""

    pooled: int = 9
    """From the correspondences of every target view's best reference view."""
    pooled_trials: int = 1500
    single_pairs: int = 16
    """View pairs, the most similar first, each of which makes a guess alone: what a target with one or two views lives on."""
    single_trials: int = 200
    clustered_pairs: int = 30
    """The most similar pairs, split into sets that agree on a rotation."""
    clusters: int = 4
    cluster_deg: float = 30.0
    cluster_trials: int = 300
    per_cluster: int = 2
    aligned_pairs: int = 60
    """Pairs taken for perfect alignments, with centre and size from the clouds."""
    max_scale_ratio: float = 2.5
    """A guess may differ by this factor from the ratio of the two clouds' extents."""


def propose(pair: MatchedPair, config: HypothesesConfig, threshold_m: float, seed: int) -> Sim3Batch:
    """Guesses of target_from_reference; empty where nothing matches. `threshold_m` is the inlier distance."""
    similarity = pair.similarity
    ranked = [(int(each[0]), int(each[1])) for each in np.argwhere(similarity > 0)]
    ranked.sort(key=lambda each: -similarity[each])
    if not ranked:
        return Sim3Batch.empty()

    def fit(pairs: Pairs, trials: int, keep: int) -> Sim3Batch:
        source, aim = end_points(pool(pair.found, pairs), pair.reference, pair.target)
        return _best_samples(source, aim, threshold_m, trials, keep, seed)

    aligned = align_clouds(pair.rotations(ranked[: config.aligned_pairs]), *pair.surfaces)
    batches = [fit(pair.best_pairs(), config.pooled_trials, config.pooled)]
    batches += [fit([each], config.single_trials, 1) for each in ranked[: config.single_pairs]]
    batches += [fit(cluster, config.cluster_trials, config.per_cluster) for cluster in _clusters(pair, ranked, config, seed)]
    together = Sim3Batch.concatenate([*batches, aligned])
    off = together.scale / aligned.scale[0]
    return together.select(((off < config.max_scale_ratio) & (off > 1 / config.max_scale_ratio)).nonzero().flatten())


def distinct(transforms: Sim3Batch, scores: torch.Tensor, angle_deg: float, count: int, symmetries: FloatArray | None = None) -> list[int]:
    """Indices of up to `count` transforms, best score first, whose rotations differ by at least `angle_deg`.

    With `symmetries` of the reference, shape (S, 3, 3), also from what those before them are after one.
    """
    turns = np.concatenate([np.eye(3)[None], np.zeros((0, 3, 3)) if symmetries is None else symmetries])
    rotations = transforms.rotation.numpy().astype(float)
    told = np.zeros((0, 3, 3))
    kept: list[int] = []
    for index in scores.argsort(descending=True).tolist():
        if not kept or angles_deg(rotations[index][None], told).min() >= angle_deg:
            kept.append(index)
            told = np.concatenate([told, rotations[index] @ turns])
        if len(kept) == count:
            break
    return kept


def _best_samples(source: FloatArray, target: FloatArray, threshold_m: float, trials: int, keep: int, seed: int) -> Sim3Batch:
    """The samples with the most inliers, each refitted to them."""
    if len(source) < MIN_CORRESPONDENCES:
        return Sim3Batch.empty()
    transforms, inliers = sample(source, target, threshold_m, trials, seed)
    best = inliers.sum(dim=1).topk(min(keep, len(transforms))).indices
    weights = inliers[best].double()
    count = len(best)
    points, aims = (torch.from_numpy(each.astype(np.float64)).expand(count, -1, -1) for each in (source, target))
    fitted, determined = umeyama_batch(points, aims, weights)
    fitted = fitted.where(determined & (weights.sum(dim=1) >= MIN_CORRESPONDENCES), transforms.select(best))
    return Sim3Batch(fitted.scale.float(), fitted.rotation.float(), fitted.translation.float())


def _clusters(pair: MatchedPair, ranked: Pairs, config: HypothesesConfig, seed: int) -> list[Pairs]:
    """Of the most similar pairs the largest agreeing set, then the largest of the rest, and so on."""
    left = ranked[: config.clustered_pairs]
    clusters: list[Pairs] = []
    while left and len(clusters) < config.clusters:
        agree = consensus(pair.rotations(left), pair.similarities(left), config.cluster_deg, seed)
        if not agree.any():
            break
        clusters.append([each for each, kept in zip(left, agree) if kept])
        left = [each for each, kept in zip(left, agree) if not kept]
    return clusters


def align_clouds(rotations: FloatArray, reference: Surface, target: Surface) -> Sim3Batch:
    """target_from_reference with the rotations as given, shape (T, 3, 3), and scale and translation such that the clouds' extents and
    medians agree."""
    size_ratio = cloud_extent_m(target.points_m) / max(cloud_extent_m(reference.points_m), 1e-9)
    centers = [torch.from_numpy(np.median(surface.points_m, axis=0)).float() for surface in (reference, target)]
    rotation = torch.from_numpy(rotations).float()
    return Sim3Batch(torch.full((len(rotation),), size_ratio), rotation, centers[1] - size_ratio * (rotation @ centers[0]))
