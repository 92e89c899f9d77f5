"""Tokens of categories that do not exist, as many as are wanted, with the statistics of those that do.

In whitened coordinates the token of a part, as a view shows it, is the sum of its category, its instance, its view, the part itself, and
noise. The variances of the first three and the covariance of parts within a view are those of recorded bursts; categories and instances
differ along the directions in which the shipped statistics say that tokens vary. A category has ALL_PARTS parts, of which a view shows the
half that faces it, and is kin to the others of its family of FAMILY. Two figures are chosen such that bursts match as those recorded do:
how much of a part is the category's and not the instance's own, by how well bursts of one category match, and how much of a category is
its family's, by how much it differs between pairs of categories how well these match. How well different categories match on average then
follows, and is printed beside what was recorded.

Letters: V views, K parts of a view, D token size.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from core.backbones.whitening import SHRINKAGE, Whitening
from core.crop import Window
from core.encode import EncodedBurst, EncodedView
from core.evidence import PARTS, Adaptation, match_views, part_tokens, whitened
from core.views import FloatArray

ALL_PARTS = 2 * PARTS
"""Of a category; a view shows half of them."""
NOISE = 0.3
"""Share of the variance of parts within a view that no other view shows again."""
TRIED = 12
"""Categories, of two instances each, that both are chosen with."""
STEPS = 5
"""Of a choice; each halves what is left open."""
TURNS = 2
"""Each is chosen so often, since one moves the other."""
FAMILY = 4
"""Categories that have something in common, as ovens and toasters do."""


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
    of_part: FloatArray
    shared: float
    """Of a part's variance, what all instances of its category have in common."""
    kin: float
    """Of a category's variance, what it has in common with its family."""
    seed: int

    @staticmethod
    def like(recorded: Sequence[tuple[str, EncodedBurst]], whitening: Whitening, seed: int) -> tuple[SyntheticTokens, Levels, Levels]:
        """From (category, burst) of recordings; and how bursts match, recorded and synthetic."""
        parts = [(category, whitened(part_tokens(burst), whitening)) for category, burst in recorded]
        means = {category: np.stack([each.mean(axis=(0, 1)) for named, each in parts if named == category]) for category, _ in parts}
        instance = float(np.mean([bursts.var(axis=0, ddof=1).sum() for bursts in means.values() if len(bursts) > 1]))
        category = max(float(np.stack([bursts.mean(axis=0) for bursts in means.values()]).var(axis=0, ddof=1).sum()) - instance / 2, 0.0)
        within = np.concatenate([(each - each.mean(axis=1, keepdims=True)).reshape(-1, each.shape[2]) for _, each in parts])
        covariance = within.T @ within / len(within)
        views = [each.mean(axis=1).var(axis=0, ddof=1).sum() for _, each in parts if len(each) > 1]
        view = (float(np.mean(views)) if views else 0.0) - float(np.trace(covariance)) / PARTS
        size = covariance.shape[0]
        made = SyntheticTokens(
            whitening,
            np.linalg.inv(whitening.matrix.astype(np.float64)).astype(np.float32),
            _shipped_root(whitening, category),
            _shipped_root(whitening, instance),
            float(np.sqrt(max(view, 0.0) / size)),
            _root(covariance).astype(np.float32),
            0.5,
            0.5,
            seed,
        )
        real = levels([named for named, _ in parts], [each for _, each in parts])
        for _ in range(TURNS):
            made = _chosen(lambda kin, made=made: replace(made, kin=kin), lambda found: found.other_spread, real.other_spread)  # type: ignore[misc]
            made = _chosen(lambda shared, made=made: replace(made, shared=shared), lambda found: found.same, real.same)  # type: ignore[misc]
        return made, real, made.levels()

    def levels(self) -> Levels:
        """Of a few of its categories."""
        names = [category for category in range(TRIED) for _ in range(2)]
        bursts = [self.parts(category, instance, 10) for category in range(TRIED) for instance in range(2)]
        return levels([str(name) for name in names], bursts)

    def parts(self, category: int, instance: int, views: int) -> FloatArray:
        """Whitened parts that views of an instance show, shape (V, K, D); the same each time."""
        size = len(self.of_part)
        family, own = (np.random.default_rng([self.seed, *name]) for name in ((0, category // FAMILY), (1, category)))
        rng = np.random.default_rng([self.seed, 2, category, instance])
        common, middle = (
            float(np.sqrt(self.kin)) * _normal(family, *shape) + float(np.sqrt(1 - self.kin)) * _normal(own, *shape)
            for shape in ((ALL_PARTS, size), (size,))
        )
        middle = middle @ self.of_category + _normal(rng, size) @ self.of_instance
        each = float(np.sqrt(self.shared)) * common + float(np.sqrt(1 - self.shared)) * _normal(rng, ALL_PARTS, size)
        faces = (np.arange(views)[:, None] * ALL_PARTS // views + rng.integers(0, ALL_PARTS // 2, (views, PARTS))) % ALL_PARTS
        deviations = float(np.sqrt(1 - NOISE)) * each[faces] + float(np.sqrt(NOISE)) * _normal(rng, views, PARTS, size)
        return np.asarray(middle + self.view_spread * _normal(rng, views, 1, size) + deviations @ self.of_part)

    def burst(self, category: int, instance: int, views: int) -> EncodedBurst:
        """The same as a burst of tokens, without depth and cameras."""
        found = self.parts(category, instance, views)
        raw = (found @ self.unwhiten + self.whitening.mean).astype(np.float32)
        return EncodedBurst(tuple(_view(*each) for each in zip(raw, found.mean(axis=1))), "synthetic")


def levels(categories: Sequence[str], parts: Sequence[FloatArray]) -> Levels:
    """How well bursts match, given their whitened parts, each (V, K, D)."""
    fitted = Adaptation.fit(parts)
    adaptation = Adaptation(fitted.mean.astype(np.float32), fitted.matrix.astype(np.float32))
    directions = [adaptation.directions(each) for each in parts]
    matches = np.stack([match_views(each, directions) for each in directions])
    named = np.array(categories)
    same = named[:, None] == named[None]
    return Levels(float(matches[same & ~np.eye(len(named), dtype=bool)].mean()), float(matches[~same].mean()), float(matches[~same].std()))


def _chosen(with_value: Callable[[float], SyntheticTokens], level: Callable[[Levels], float], wanted: float) -> SyntheticTokens:
    """With the share at which a level, which grows with it, is as wanted."""
    low, high = 0.0, 1.0
    for _ in range(STEPS):
        made = with_value((low + high) / 2)
        low, high = ((low + high) / 2, high) if level(made.levels()) < wanted else (low, (low + high) / 2)
    return made


def _shipped_root(whitening: Whitening, variance: float) -> NDArray[np.float32]:
    """A root, shape (D, D), of the shipped covariance of tokens, whitened, scaled to this total variance."""
    roots, vectors = np.linalg.eigh(whitening.matrix.astype(np.float64))
    widened = 1 / roots**2
    variances = (widened - widened.mean() * SHRINKAGE / (1 + SHRINKAGE)).clip(0) * roots**2
    return np.asarray((vectors * np.sqrt(variance * variances / variances.sum())) @ vectors.T, dtype=np.float32)


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
