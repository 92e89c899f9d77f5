"""Our similarity of a burst to a category (`best`): whitened patches matched view by view, less what both resemble anyway.

Three things beyond the paper's cosines of [CLS]:
- patches of the block that serves correspondences, whitened by what ships and then by what this memory has seen;
- every view counts by the other side's view it matches best, since opposite sides of one object look unalike;
- from a match is taken what burst and member reach with other categories: some objects resemble everything (hubs), and a burst of many
  views finds a good match for each of them. What is left does not grow with the number of views.

Letters: V, W views, K patches a view, D token size, C categories.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from core.backbones.whitening import Whitening
from core.encode import EncodedBurst

FloatArray = NDArray[np.floating]

PATCHES = 24
"""Patches kept of each view, drawn at random: the figures of 12 and of 48 differ by less than a hundredth."""
COHORT = 5
"""Other categories that tell how well a burst matches anything: the most similar ones."""
SHORTLIST = 5
"""Categories, the best matching first, whose evidence is computed."""
ADAPTATION_PRIOR = 4.0
"""Bursts for which the shipped mean counts when the memory's own moves it."""
COVARIANCE_PRIOR = 32.0
"""The same of the covariance: of few objects it would be the differences between just these, and take them out."""
ADAPTED = 4
"""Every so many-th patch takes part in the statistics: there are thousands, alike within a view."""
BATCH = 16
"""Bursts matched at once: about 40 MB."""


def sample_patches(encoded: EncodedBurst, patches: int = PATCHES) -> NDArray[np.float16]:
    """Tokens of random foreground patches, shape (V, K = patches, D), of views that show an object; drawn again where there are fewer."""
    rng = np.random.default_rng(0)
    shown = [view.descriptors for view in encoded.views if len(view.descriptors)]
    return np.stack([tokens[rng.permutation(len(tokens))[np.arange(patches) % len(tokens)]] for tokens in shown]).astype(np.float16)


def whitened(patches: FloatArray, whitening: Whitening | None) -> FloatArray:
    """The same, whitened where the backbone has statistics."""
    return patches.astype(np.float32) if whitening is None else whitening.apply(patches.astype(np.float32))


@dataclass(frozen=True, eq=False)
class Adaptation:
    """An affine map that takes out what the objects of one memory have in common: its cameras, its light, its kind of place."""

    mean: FloatArray
    """Shape (D,)."""
    matrix: FloatArray
    """Shape (D, D)."""

    @staticmethod
    def fit(members: Sequence[FloatArray]) -> Adaptation:
        """From the whitened patches of bursts, each (V, K, D), without any label.

        Few bursts say little of D² covariances: mean and covariance are shrunk towards those that ship, which are zero and isotropic here.
        """
        drawn = [member[:, ::ADAPTED].reshape(-1, member.shape[-1]).astype(np.float64) for member in members]
        count = len(drawn)
        mean = np.mean([each.mean(axis=0) for each in drawn], axis=0)
        centred = np.concatenate(drawn) - mean
        covariance = centred.T @ centred / len(centred)
        variance = float(np.trace(covariance)) / len(mean)
        covariance = (count * covariance + COVARIANCE_PRIOR * variance * np.eye(len(mean))) / (count + COVARIANCE_PRIOR)
        variances, vectors = np.linalg.eigh(covariance)
        scaled = vectors / np.sqrt(variances.clip(0) + max(variance, 1e-12))
        return Adaptation(count * mean / (count + ADAPTATION_PRIOR), scaled @ vectors.T)

    @staticmethod
    def none(size: int) -> Adaptation:
        """Of a memory that holds nothing, for tokens of this size D."""
        return Adaptation(np.zeros(size), np.eye(size))

    def directions(self, patches: FloatArray) -> Tensor:
        """Unit patches, shape (V, K, D), of whitened ones."""
        return torch.nn.functional.normalize(torch.from_numpy((patches - self.mean) @ self.matrix).float(), dim=-1)


def match_views(target: Tensor, others: Sequence[Tensor]) -> FloatArray:
    """How well a burst matches each of others, shape (len(others),), of unit patches (V, K, D) and (W, K, D).

    Two views match by the mean over patches of the cosine to the other's most similar patch, both ways; two bursts by the mean over views
    of the match with the other's best matching view, both ways.
    """
    found: list[float] = []
    for start in range(0, len(others), BATCH):
        batch = others[start : start + BATCH]
        stacked = torch.cat(list(batch))
        cosines = (target.flatten(0, 1) @ stacked.flatten(0, 1).T).view(*target.shape[:2], *stacked.shape[:2])
        views = (cosines.amax(dim=3).mean(dim=1) + cosines.amax(dim=1).mean(dim=2)) / 2
        for each in torch.split(views, [len(other) for other in batch], dim=1):
            found.append(float((each.amax(dim=0).mean() + each.amax(dim=1).mean()) / 2))
    return np.array(found)


def cohort_level(matches: FloatArray, prior: float, cohort: int = COHORT) -> FloatArray:
    """Mean of the `cohort` best of the matches with other categories, shape (*) from (*, C).

    −inf stands for no category; what is missing to `cohort` counts as `prior`.
    """
    count = matches.shape[-1]
    best = np.partition(matches, count - cohort, axis=-1)[..., -cohort:] if count > cohort else matches
    there = best > -np.inf
    return np.asarray((np.where(there, best, prior).sum(axis=-1) + prior * max(cohort - count, 0)) / cohort)


@dataclass(frozen=True, eq=False)
class Entry:
    """A member of the memory as the evidence sees it."""

    category_id: str
    patches: Tensor
    """Unit patches, adapted to the memory, shape (V, K, D)."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """One burst against the categories of a memory, or the nearest of them.

    A category's first member, its founder, represents it to others.
    """

    matches: Mapping[str, float]
    """By category, of the burst with the member it matches best."""
    founders: Mapping[str, float]
    """By category, of the burst with the founder."""
    cohorts: Mapping[str, Mapping[str, float]]
    """By category, for those of `best_matching` at least: of the best matching member with the founders of the other categories."""
    prior: float
    """Usual match with the most similar of other categories."""

    @staticmethod
    def between(target: Tensor, entries: Sequence[Entry], prior: float) -> Comparison:
        """With every member, oldest first, patch by patch: the rule that `core.enrolled` keeps to.

        `target`: unit patches, adapted to the same memory, shape (V, K, D).
        """
        found = match_views(target, [entry.patches for entry in entries])
        best: dict[str, int] = {}
        founders: dict[str, int] = {}
        for index, entry in enumerate(entries):
            founders.setdefault(entry.category_id, index)
            if found[index] > found[best.setdefault(entry.category_id, index)]:
                best[entry.category_id] = index
        matches = {category: float(found[index]) for category, index in best.items()}
        of_founders = [entries[index].patches for index in founders.values()]
        cohorts = {
            category: dict(zip(founders, match_views(entries[best[category]].patches, of_founders).tolist()))
            for category in best_matching(matches)
        }
        return Comparison(matches, {category: float(found[index]) for category, index in founders.items()}, cohorts, prior)

    def ranked(self, without: str | None = None) -> list[tuple[str, float]]:
        """(category, evidence) of the SHORTLIST best matching categories, most evidence first; as if `without` were not in the memory."""
        shortlist = [category for category in best_matching(self.matches) if category != without][:SHORTLIST]
        evidence = {category: self._evidence(category, {category, without}) for category in shortlist}
        return sorted(evidence.items(), key=lambda entry: (-entry[1], entry[0]))

    def _evidence(self, category: str, left_out: Collection[str | None]) -> float:
        of_burst, of_member = (
            cohort_level(np.array([match for other, match in found.items() if other not in left_out]), self.prior)
            for found in (self.founders, self.cohorts[category])
        )
        return float(self.matches[category] - (of_burst + of_member) / 2)


def best_matching(matches: Mapping[str, float]) -> list[str]:
    """The SHORTLIST best matching categories and one more, best first: one may be left out."""
    return sorted(matches, key=lambda category: -matches[category])[: SHORTLIST + 1]
