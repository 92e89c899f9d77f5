"""Our similarity of a burst to a category (`best`): whitened patches matched view by view, less what both resemble anyway.

Four things beyond the paper's cosines of [CLS]:
- patches of the block that serves correspondences, whitened by what ships and then by what this memory has seen;
- every view counts by the other side's view it matches best, since opposite sides of one object look unalike;
- a match counts by how far it exceeds what burst and member reach with other categories: some objects resemble everything (hubs), some
  everything a little and some nothing, and a burst of many views finds a good match for each of them. What is left grows neither with the
  number of views nor with that of categories (speaker recognition normalises its scores by a cohort likewise);
- two members of a category speak for it, where it has two.

Letters: V, W views, K patches a view, D token size, C categories.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from core.backbones.whitening import Whitening
from core.encode import EncodedBurst

FloatArray = NDArray[np.floating]

PATCHES = 24
"""Patches kept of each view, drawn at random: the figures of 12 and of 48 differ by less than a hundredth."""
COHORT = 32
"""Other categories that tell how well a burst matches anything: the oldest, so that they stay the same while a memory grows."""
COHORT_PRIOR = 3.0
"""Categories for which the shipped usual match counts beside those of the memory."""
DEVIATIONS = 3.0
"""Standard deviations above the mean of matches with other categories from which on a match speaks for its category."""
MEMBERS = 2
"""Members of a category, the best matching ones, whose evidence is averaged: one alone may match by chance."""
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


@dataclass(frozen=True)
class Usual:
    """Matches of a burst with categories that it is not of, before anything is known of them."""

    mean: float
    deviation: float


def cohort_level(matches: FloatArray, usual: Usual, deviations: float = DEVIATIONS) -> FloatArray:
    """DEVIATIONS above the mean of matches with other categories, shape (*) from (*, C); −inf stands for no category."""
    there = matches > -np.inf
    count = there.sum(axis=-1) + COHORT_PRIOR
    mean = (np.where(there, matches, 0.0).sum(axis=-1) + COHORT_PRIOR * usual.mean) / count
    squares = np.where(there, matches - mean[..., None], 0.0) ** 2
    return np.asarray(mean + deviations * np.sqrt((squares.sum(axis=-1) + COHORT_PRIOR * usual.deviation**2) / count))


@dataclass(frozen=True, eq=False)
class Entry:
    """A member of the memory as the evidence sees it."""

    category_id: str
    patches: Tensor
    """Unit patches, adapted to the memory, shape (V, K, D)."""


@dataclass(frozen=True)
class Matched:
    """A member that a burst was matched with."""

    match: float
    cohort: Mapping[str, float]
    """The member's own matches with the founders of COHORT categories, by category."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """One burst against the categories of a memory, or the nearest of them.

    A category's first member, its founder, represents it to others.
    """

    matched: Mapping[str, Sequence[Matched]]
    """By category, best matching first: up to MEMBERS of its members, the best matching ones. SHORTLIST categories and one more: one may
    be left out."""
    cohort: Mapping[str, float]
    """Of the burst with the founders of COHORT categories, by category."""
    usual: Usual

    @staticmethod
    def between(target: Tensor, entries: Sequence[Entry], usual: Usual) -> Comparison:
        """With every member, oldest first, patch by patch: the rule that `core.enrolled` keeps to.

        `target`: unit patches, adapted to the same memory, shape (V, K, D).
        """
        found = match_views(target, [entry.patches for entry in entries])
        founders = cohort_of([entry.category_id for entry in entries])
        of_founders = [entries[index].patches for index in founders.values()]

        def own_cohort(place: int) -> dict[str, float]:
            return dict(zip(founders, match_views(entries[place].patches, of_founders).tolist()))

        cohort = {category: float(found[place]) for category, place in founders.items()}
        return Comparison.of([entry.category_id for entry in entries], found, own_cohort, cohort, usual)

    @staticmethod
    def of(
        categories: Sequence[str],
        matches: FloatArray,
        own_cohort: Callable[[int], Mapping[str, float]],
        cohort: Mapping[str, float],
        usual: Usual,
    ) -> Comparison:
        """From the matches with members of these categories, shape (number of members,); `own_cohort` gives a member's, by its place."""
        best = best_members(categories, matches)
        matched = {category: [Matched(float(matches[place]), own_cohort(place)) for place in places] for category, places in best.items()}
        return Comparison(matched, cohort, usual)

    def ranked(self, without: str | None = None) -> list[tuple[str, float]]:
        """(category, evidence) of the SHORTLIST best matching categories, most evidence first; as if `without` were not in the memory."""
        shortlist = [category for category in self.matched if category != without][:SHORTLIST]
        evidence = {category: self._evidence(category, {category, without}) for category in shortlist}
        return sorted(evidence.items(), key=lambda entry: (-entry[1], entry[0]))

    def _evidence(self, category: str, left_out: Collection[str | None]) -> float:
        members = self.matched[category]
        of_burst, *of_members = (
            cohort_level(np.array([match for other, match in found.items() if other not in left_out]), self.usual)
            for found in (self.cohort, *(member.cohort for member in members))
        )
        return float(np.mean([member.match - (of_burst + level) / 2 for member, level in zip(members, of_members)]))


def cohort_of(categories: Sequence[str]) -> dict[str, int]:
    """The founders of the COHORT oldest categories, by category: places among members, whose categories these are, oldest first."""
    founders: dict[str, int] = {}
    for place, category in enumerate(categories):
        founders.setdefault(category, place)
    return dict(islice(founders.items(), COHORT))


def best_members(categories: Sequence[str], matches: FloatArray) -> dict[str, list[int]]:
    """By category, best matching first and SHORTLIST + 1 of them, its MEMBERS best matching members: places among members of these
    categories and with these matches, shape (number of members,)."""
    best: dict[str, list[int]] = {}
    for place in np.argsort(-matches, kind="stable").tolist():
        if categories[place] in best or len(best) <= SHORTLIST:
            places = best.setdefault(categories[place], [])
            if len(places) < MEMBERS:
                places.append(place)
    return best
