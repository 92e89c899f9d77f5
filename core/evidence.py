"""Our similarity of a burst to a category (`best`): whitened parts matched view by view, less what both resemble anyway.

Five things beyond the paper's cosines of [CLS]:
- tokens of the block that serves correspondences, whitened by what ships and then by what this memory has seen;
- of each view the mean tokens of a few parts, which are patches that look alike: what single patches show differs from object to object;
- every view counts by the other side's view it matches best, since opposite sides of one object look unalike;
- a match counts by how far it exceeds what burst and member reach with other categories: some objects resemble everything (hubs), some
  everything a little and some nothing, and a burst of many views finds a good match for each of them. What is left grows neither with the
  number of views nor with that of categories (speaker recognition normalises its scores by a cohort likewise);
- two members of a category speak for it, where it has two.

Letters: V, W views, P foreground patches and K parts of a view, D token size, C categories, N bursts or members; * is any batch shape.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.cluster.hierarchy import fcluster, linkage
from torch import Tensor

from core.backbones.whitening import Whitening
from core.encode import EncodedBurst
from core.views import FloatArray

PARTS = 12
"""Of each view: with twice as many, or half, the figures differ by less than a hundredth."""
TAKEN = 64
"""Patches of a view, evenly spaced, that its parts are made of: all of them make no better ones, and take longer, with their square."""
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
LEAST_VARIANCE = 1e-12
"""Added at least in every direction, so that a memory of one and the same token can be adapted to."""
BATCH = 16
"""Bursts matched at once: cosines of about 1 MB with ten views a side."""


def part_tokens(encoded: EncodedBurst, parts: int = PARTS) -> NDArray[np.float16]:
    """Tokens of the parts of each view, shape (V, K = parts, D), as of `merged`.

    V counts the views that show an object, of which there must be one; the encoder answers none otherwise.
    """
    return np.stack([merged(view.descriptors, parts) for view in encoded.views if len(view.descriptors)])


def merged(tokens: FloatArray, parts: int = PARTS) -> NDArray[np.float16]:
    """Mean tokens of clusters of like patches (Ward 1963), shape (K = parts, D), from those of P > 0 patches, shape (P, D).

    Where there are fewer clusters they are repeated.
    """
    taken = tokens[np.unique(np.linspace(0, len(tokens) - 1, TAKEN).round().astype(int))].astype(np.float32)
    part_of = fcluster(linkage(taken, "ward"), parts, "maxclust") if len(taken) > 1 else np.ones(1)
    means = np.stack([taken[part_of == part].mean(axis=0) for part in np.unique(part_of)])
    return np.asarray(means[np.arange(parts) % len(means)], dtype=np.float16)


def whitened(tokens: FloatArray, whitening: Whitening | None) -> FloatArray:
    """Tokens, shape (*, D), in single precision, and whitened where the backbone has statistics."""
    return tokens.astype(np.float32) if whitening is None else whitening.apply(tokens.astype(np.float32))


@dataclass(frozen=True, eq=False)
class Adaptation:
    """An affine map that takes out what the objects of one memory have in common: its cameras, its light, its kind of place."""

    mean: FloatArray
    """Shape (D,)."""
    matrix: FloatArray
    """Shape (D, D)."""

    @staticmethod
    def fit(members: Sequence[FloatArray]) -> Adaptation:
        """From the whitened parts of at least one burst, each (V, K, D), without any label.

        Few bursts say little of D² covariances: mean and covariance are shrunk towards those that ship, which after whitening are taken to
        be zero and isotropic. The mean variance is added once more, so that directions of little variance are not blown up.
        """
        tokens = [member.reshape(-1, member.shape[-1]).astype(np.float64) for member in members]
        count = len(tokens)
        mean = np.mean([each.mean(axis=0) for each in tokens], axis=0)
        centred = np.concatenate(tokens) - mean
        covariance = centred.T @ centred / len(centred)
        variance = float(np.trace(covariance)) / len(mean)
        covariance = (count * covariance + COVARIANCE_PRIOR * variance * np.eye(len(mean))) / (count + COVARIANCE_PRIOR)
        variances, vectors = np.linalg.eigh(covariance)
        scaled = vectors / np.sqrt(variances.clip(0) + max(variance, LEAST_VARIANCE))
        return Adaptation(count * mean / (count + ADAPTATION_PRIOR), scaled @ vectors.T)

    @staticmethod
    def none(size: int) -> Adaptation:
        """That of a memory that holds nothing, for tokens of size D: it changes nothing."""
        return Adaptation(np.zeros(size), np.eye(size))

    def directions(self, parts: FloatArray) -> Tensor:
        """Adapted parts of length 1, from whitened ones, both shape (V, K, D)."""
        return torch.nn.functional.normalize(torch.from_numpy((parts - self.mean) @ self.matrix).float(), dim=-1)


def match_views(target: Tensor, others: Sequence[Tensor]) -> FloatArray:
    """How well a burst matches each of N others, shape (N,), from unit parts: (V, K, D), and (W, K, D) of each other.

    Two views match by the mean over parts of the cosine to the other's most similar part, both ways; two bursts by the mean over views
    of the match with the other's best matching view, both ways.
    """
    found = [np.zeros(0)]
    for start in range(0, len(others), BATCH):
        batch = others[start : start + BATCH]
        stacked = torch.cat(list(batch))
        cosines = (target.flatten(0, 1) @ stacked.flatten(0, 1).T).view(*target.shape[:2], *stacked.shape[:2])
        views = ((cosines.amax(dim=3).mean(dim=1) + cosines.amax(dim=1).mean(dim=2)) / 2).numpy()
        counts = np.array([len(other) for other in batch])
        firsts = np.cumsum(counts) - counts
        there = np.maximum.reduceat(views, firsts, axis=1).mean(axis=0, dtype=float)
        back = np.add.reduceat(views.max(axis=0), firsts, dtype=float) / counts
        found.append((there + back) / 2)
    return np.concatenate(found)


@dataclass(frozen=True)
class Usual:
    """Matches of a burst with categories that it is not of, before anything is known of them."""

    mean: float
    deviation: float


def cohort_level(matches: FloatArray, usual: Usual, deviations: float = DEVIATIONS) -> FloatArray:
    """So many standard deviations above the mean of the matches with other categories, shape (*) from (*, C); −inf stands for no category.

    Mean and variance are those of the matches and of `usual`, which counts as COHORT_PRIOR of them; without any they are the usual ones.
    """
    there = matches > -np.inf
    count = there.sum(axis=-1) + COHORT_PRIOR
    mean = (np.where(there, matches, 0.0).sum(axis=-1) + COHORT_PRIOR * usual.mean) / count
    squares = np.where(there, matches - mean[..., None], 0.0) ** 2
    return np.asarray(mean + deviations * np.sqrt((squares.sum(axis=-1) + COHORT_PRIOR * usual.deviation**2) / count))


@dataclass(frozen=True, eq=False)
class Entry:
    """A member of the memory as the evidence sees it."""

    category_id: str
    parts: Tensor
    """Unit parts, adapted to the memory, shape (V, K, D)."""


@dataclass(frozen=True)
class Matched:
    """A member that a burst was matched with."""

    match: float
    cohort: Mapping[str, float]
    """The member's own matches with the founders of the COHORT oldest categories, by category; with its own, too."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """One burst against the categories of a memory, or the nearest of them.

    A category's oldest member, its founder, represents it to others.
    """

    matched: Mapping[str, Sequence[Matched]]
    """By category, best matching first: up to MEMBERS of its members, the best matching ones. Up to SHORTLIST categories and one more:
    one may be left out."""
    cohort: Mapping[str, float]
    """The burst's matches with the founders of the COHORT oldest categories, by category."""
    usual: Usual

    @staticmethod
    def between(target: Tensor, entries: Sequence[Entry], usual: Usual) -> Comparison:
        """With every member, oldest first, part by part: the rule that `core.enrolled` keeps to.

        `target`: unit parts, adapted to the same memory, shape (V, K, D).
        """
        found = match_views(target, [entry.parts for entry in entries])

        def of_member(place: int, founders: Sequence[int]) -> list[float]:
            return match_views(entries[place].parts, [entries[founder].parts for founder in founders]).tolist()

        return Comparison.of([entry.category_id for entry in entries], found, of_member, usual)

    @staticmethod
    def of(
        categories: Sequence[str], matches: FloatArray, of_member: Callable[[int, Sequence[int]], Sequence[float]], usual: Usual
    ) -> Comparison:
        """From the burst's matches, shape (N,), with members, oldest first, of these categories: all there are, or some with the cohort.

        `of_member`: gives the matches of the member at a place with the founders at others; asked of the best matching members alone.
        """
        founders = cohort_of(categories)
        places = list(founders.values())

        def matched(place: int) -> Matched:
            return Matched(float(matches[place]), dict(zip(founders, of_member(place, places))))

        best = {category: [matched(place) for place in members] for category, members in best_members(categories, matches).items()}
        return Comparison(best, dict(zip(founders, matches[places].tolist())), usual)

    def ranked(self, without: str | None = None) -> list[tuple[str, float]]:
        """(category, evidence) of up to SHORTLIST categories, the best matching ones, most evidence first.

        As if `without` were not in the memory, but that parts stay adapted to it too, and that no younger category takes its place in the
        cohort.
        """
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
    """The founders of up to COHORT categories, the oldest, by category: places among members, oldest first, of these categories."""
    founders: dict[str, int] = {}
    for place, category in enumerate(categories):
        founders.setdefault(category, place)
    return dict(islice(founders.items(), COHORT))


def best_members(categories: Sequence[str], matches: FloatArray) -> dict[str, list[int]]:
    """By category, best matching first, up to MEMBERS of its members, the best matching ones: places among members of these categories
    and with these matches, shape (N,). Up to SHORTLIST + 1 categories."""
    best: dict[str, list[int]] = {}
    for place in np.argsort(-matches, kind="stable").tolist():
        if categories[place] in best or len(best) <= SHORTLIST:
            places = best.setdefault(categories[place], [])
            if len(places) < MEMBERS:
                places.append(place)
    return best
