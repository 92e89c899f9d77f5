"""Tokens of categories that do not exist, as many as are wanted, with the statistics of those that do.

In whitened coordinates a patch is the sum of its category, its instance, its view, the part of the object that it shows, and noise. The
variances of the first three and the covariance of patches within a view are those of recorded bursts; categories and instances differ
along the directions in which the shipped statistics say that tokens vary. A category has PARTS parts, of which a view shows the half that
faces it. How much of a part is the category's and not the instance's own is chosen such that bursts of one category match each other as
well as those recorded do; how well others match then follows, and is printed beside what was recorded.

Letters: V views, K patches of a view, D token size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from core.backbones.whitening import SHRINKAGE, Whitening
from core.crop import Window
from core.encode import EncodedBurst, EncodedView
from core.evidence import PATCHES, Adaptation, match_views, sample_patches, whitened
from core.views import FloatArray

PARTS = 48
NOISE = 0.3
"""Share of the variance of patches within a view that no other view shows again."""
TRIED = 8
"""Categories, of two instances each, that the share of a part is chosen with."""
STEPS = 6
"""Of that choice; each halves what is left open."""


@dataclass(frozen=True)
class Levels:
    """How well bursts match, mean and deviation, of one category and of different ones."""

    same: float
    other: float
    other_spread: float


@dataclass(frozen=True, eq=False)
class SyntheticTokens:
    """See module. The maps take normal numbers, shape (*, D), to deviations of whitened tokens."""

    whitening: Whitening
    unwhiten: FloatArray
    of_category: FloatArray
    of_instance: FloatArray
    view_spread: float
    of_patch: FloatArray
    shared: float
    """Of a part's variance, what all instances of its category have in common."""
    seed: int

    @staticmethod
    def like(recorded: Sequence[tuple[str, EncodedBurst]], whitening: Whitening, seed: int) -> tuple[SyntheticTokens, Levels, Levels]:
        """From (category, burst) of recordings; and how bursts match, recorded and synthetic."""
        patches = [(category, whitened(sample_patches(burst), whitening).astype(np.float64)) for category, burst in recorded]
        means = {category: np.stack([each.mean(axis=(0, 1)) for named, each in patches if named == category]) for category, _ in patches}
        instance = float(np.mean([bursts.var(axis=0, ddof=1).sum() for bursts in means.values() if len(bursts) > 1]))
        category = max(float(np.stack([bursts.mean(axis=0) for bursts in means.values()]).var(axis=0, ddof=1).sum()) - instance / 2, 0.0)
        within = np.concatenate([(each - each.mean(axis=1, keepdims=True)).reshape(-1, each.shape[2]) for _, each in patches])
        covariance = within.T @ within / len(within)
        view = float(np.mean([each.mean(axis=1).var(axis=0, ddof=1).sum() for _, each in patches])) - float(np.trace(covariance)) / PATCHES
        shape, size = _shipped_shape(whitening), covariance.shape[0]
        made = SyntheticTokens(
            whitening,
            np.linalg.inv(whitening.matrix.astype(np.float64)).astype(np.float32),
            (shape * np.sqrt(category)).astype(np.float32),
            (shape * np.sqrt(instance)).astype(np.float32),
            float(np.sqrt(max(view, 0.0) / size)),
            _root(covariance).astype(np.float32),
            0.5,
            seed,
        )
        real = levels([named for named, _ in patches], [each for _, each in patches])
        low, high = 0.0, 1.0
        for _ in range(STEPS):
            made = replace(made, shared=(low + high) / 2)
            low, high = (made.shared, high) if made.levels().same < real.same else (low, made.shared)
        return made, real, made.levels()

    def levels(self) -> Levels:
        """Of a few of its categories."""
        names = [category for category in range(TRIED) for _ in range(2)]
        bursts = [self.patches(category, instance, 10) for category in range(TRIED) for instance in range(2)]
        return levels([str(name) for name in names], bursts)

    def patches(self, category: int, instance: int, views: int) -> FloatArray:
        """Whitened patches of an instance, shape (V, K, D); the same each time."""
        size = len(self.of_patch)
        own, rng = np.random.default_rng([self.seed, category]), np.random.default_rng([self.seed, category, 1 + instance])
        shared_parts = _normal(own, PARTS, size)
        middle = _normal(own, size) @ self.of_category + _normal(rng, size) @ self.of_instance
        parts = np.sqrt(self.shared) * shared_parts + np.sqrt(1 - self.shared) * _normal(rng, PARTS, size)
        faces = (np.arange(views)[:, None] * PARTS // views + rng.integers(0, PARTS // 2, (views, PATCHES))) % PARTS
        deviations = np.sqrt(1 - NOISE) * parts[faces] + np.sqrt(NOISE) * _normal(rng, views, PATCHES, size)
        return np.asarray(middle + self.view_spread * _normal(rng, views, 1, size) + deviations @ self.of_patch)

    def burst(self, category: int, instance: int, views: int) -> EncodedBurst:
        """The same as a burst of tokens, without depth and cameras."""
        found = self.patches(category, instance, views)
        raw = (found @ self.unwhiten + self.whitening.mean).astype(np.float32)
        return EncodedBurst(tuple(_view(*each) for each in zip(raw, found.mean(axis=1))), "synthetic")


def levels(categories: Sequence[str], patches: Sequence[FloatArray]) -> Levels:
    """How well bursts match, given their whitened patches, each (V, K, D)."""
    adaptation = Adaptation.fit(patches)
    directions = [adaptation.directions(each) for each in patches]
    matches = np.stack([match_views(each, directions) for each in directions])
    named = np.array(categories)
    same = named[:, None] == named[None]
    return Levels(float(matches[same & ~np.eye(len(named), dtype=bool)].mean()), float(matches[~same].mean()), float(matches[~same].std()))


def _shipped_shape(whitening: Whitening) -> FloatArray:
    """A root, shape (D, D), of the shipped covariance of tokens, whitened, with trace 1."""
    roots, vectors = np.linalg.eigh(whitening.matrix.astype(np.float64))
    widened = 1 / roots**2
    variances = (widened - widened.mean() * SHRINKAGE / (1 + SHRINKAGE)).clip(0) * roots**2
    return np.asarray((vectors * np.sqrt(variances / variances.sum())) @ vectors.T)


def _root(covariance: FloatArray) -> FloatArray:
    variances, vectors = np.linalg.eigh(covariance)
    return np.asarray((vectors * np.sqrt(variances.clip(0))) @ vectors.T)


def _normal(rng: np.random.Generator, *shape: int) -> FloatArray:
    return rng.standard_normal(shape, dtype=np.float32)


def _view(descriptors: FloatArray, pooled: FloatArray) -> EncodedView:
    count, size = descriptors.shape
    return EncodedView(
        grid=28,
        window=Window(0, 0, 392),
        cells=np.stack([np.arange(count) // 28, np.arange(count) % 28], axis=1).astype(np.int16),
        descriptors=descriptors,
        points_m=np.full((count, 3), np.nan),
        saliency=np.zeros((1, 1), dtype=np.float32),
        cls=np.zeros(size, dtype=np.float32),
        pooled=pooled.astype(np.float32),
        camera=None,
    )
