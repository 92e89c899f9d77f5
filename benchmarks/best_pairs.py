"""The score `best` over episodes: evidence as `core.evidence` and `core.novelty` make it, from tables of all pairs.

Letters: T memories side by side, C categories (as many as the largest has), H bursts held, S shortlisted categories (SHORTLIST, or C where
that is less), N bursts, G stages of what a memory adapts to (`benchmarks.matches.STAGES`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.matches import STAGES
from core.calibration import Prior
from core.evidence import COHORT, DEVIATIONS, MEMBERS, SHORTLIST, cohort_level
from core.novelty import VERIFIED
from core.views import FloatArray

IntArray = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class BestPairs:
    """Tables of all pairs of bursts."""

    match: FloatArray
    """Matches at each stage, shape (G, N, N)."""
    agreement: FloatArray | None
    """Of reference i with burst j at the best pose, shape (N, N); None where poses take no part."""
    prior: Prior

    def single(self) -> FloatArray:
        """Evidence of every burst alone for every burst, shape (N, N), with poses where there are any: as `single_evidence`."""
        evidence = single_evidence(self.match[-1], self.prior)
        return evidence if self.agreement is None else evidence + self.prior.agreement_weight * self.agreements()

    def most(self) -> float:
        """Evidence that no burst exceeds in any memory: of the best match and pose, where nothing else matches."""
        match = self.match[:, ~np.eye(self.match.shape[1], dtype=bool)]
        least = min(float(match.min()), self.prior.usual.mean)
        return float(self.match.max()) - least + (0.0 if self.agreement is None else self.prior.agreement_weight)

    def without(self, burst: int) -> BestPairs:
        """The same without a burst."""
        kept = np.delete(np.arange(self.match.shape[1]), burst)
        agreement = None if self.agreement is None else self.agreement[np.ix_(kept, kept)]
        return replace(self, match=self.match[:, kept][:, :, kept], agreement=agreement)

    def agreements(self) -> FloatArray:
        """Agreement of reference i with burst j, shape (N, N): 1 with itself, 0 where it has no pose."""
        assert self.agreement is not None
        return np.where(np.eye(len(self.agreement), dtype=bool), 1.0, np.nan_to_num(self.agreement))


def single_evidence(match: FloatArray, prior: Prior, deviations: float = DEVIATIONS) -> FloatArray:
    """Evidence by tokens of every burst for every burst, from their matches, both (N, N), as if each were a category of its own.

    Simpler than the rule: the cohort of each is all others, the burst it is compared with among them.
    """
    others = np.where(np.eye(len(match), dtype=bool), -np.inf, match)
    level = cohort_level(others, prior.usual, deviations)
    return np.asarray(match - (level[:, None] + level[None, :]) / 2)


class BestSource:
    """See `benchmarks.episodes.Source`. A category is represented to others by its founder, whose reference is also what poses verify.

    Unlike a service's, a memory holds a burst that comes again once, in the category that it joined last. All are adapted to the number of
    bursts that any of them holds.
    """

    def __init__(self, pairs: BestPairs, room: int) -> None:
        self._pairs, self._room = pairs, room
        self._agreement = None if pairs.agreement is None else pairs.agreements() * pairs.prior.agreement_weight

    def begin(self, thresholds: int) -> None:
        """See `Source`."""
        bursts = self._pairs.match.shape[1]
        self._of = np.full((thresholds, bursts), -1, dtype=np.intp)
        self._founder = np.zeros((thresholds, self._room), dtype=np.intp)
        self._best = np.full((len(STAGES), thresholds, self._room, bursts), -np.inf, dtype=np.float32)
        self._held: list[int] = []
        self.tried = np.zeros((thresholds, 0), dtype=np.intp)
        """The categories whose poses the last decision tried, shape (T, up to VERIFIED)."""

    def nearest(self, burst: int, used: IntArray) -> tuple[IntArray, FloatArray]:
        """See `Source`."""
        categories, evidence = self.ranked(burst, used, np.full(len(used), -1))
        return categories[:, 0], evidence[:, 0]

    def ranked(self, burst: int, used: IntArray, without: IntArray, verify: IntArray | None = None) -> tuple[IntArray, FloatArray]:
        """Shortlisted categories and their evidence, most first, shapes (T, S), (T, S); −inf where a memory has fewer.

        Args:
            used: number of categories, shape (T,).
            without: a category of each memory that is left out, −1 for none, shape (T,).
            verify: the only categories whose poses take part, as of `tried`; those with the most evidence here where left out.
        """
        most = max(int(used.max()), 1)
        there = (np.arange(most) < used[:, None]) & (np.arange(most) != without[:, None])
        stage = int(np.searchsorted(STAGES, len(self._held), side="right")) - 1
        raw = np.where(there, self._best[stage, :, :most, burst], -np.inf)
        shortlist = np.argsort(-raw, axis=1, kind="stable")[:, :SHORTLIST]
        there_short = np.isfinite(np.take_along_axis(raw, shortlist, axis=1))
        evidence = np.where(there_short, self._by_tokens(stage, burst, shortlist, there), -np.inf)
        if verify is None:
            place = np.argsort(-evidence, axis=1, kind="stable")[:, :VERIFIED]
            verify = self.tried = np.take_along_axis(shortlist, place, axis=1)
        if self._agreement is not None:
            gained = self._agreement[np.take_along_axis(self._founder, shortlist, axis=1), burst]
            evidence = evidence + np.where((shortlist[:, :, None] == verify[:, None, :]).any(axis=2), gained, 0.0)
        order = np.argsort(-evidence, axis=1, kind="stable")
        return np.take_along_axis(shortlist, order, axis=1), np.take_along_axis(evidence, order, axis=1)

    def learn(self, burst: int, chosen: IntArray, rows: IntArray) -> None:
        """See `Source`."""
        new = ~(self._of[rows] == chosen[:, None]).any(axis=1)
        self._founder[rows[new], chosen[new]] = burst
        self._best[:, rows, chosen] = np.maximum(self._best[:, rows, chosen], self._pairs.match[:, None, burst])
        self._of[rows, burst] = chosen
        if len(rows) and burst not in self._held:
            self._held.append(burst)

    def _by_tokens(self, stage: int, burst: int, shortlist: IntArray, there: NDArray[np.bool_]) -> FloatArray:
        """Evidence for the shortlist, shape (T, S), as of `core.evidence.Comparison`; `there` says which categories count, shape (T, C)."""
        match, usual, held = self._pairs.match[stage], self._pairs.prior.usual, np.array(self._held, dtype=np.intp)
        if not len(held):
            return np.zeros(shortlist.shape)
        own = np.where(self._of[:, None, held] == shortlist[:, :, None], match[held, burst], -np.inf)  # (T, S, H)
        order = np.argsort(-own, axis=2, kind="stable")[:, :, :MEMBERS]
        own, member = np.take_along_axis(own, order, axis=2), held[order]
        oldest = min(there.shape[1], COHORT)
        founder, counts = self._founder[:, :oldest], there[:, None, :oldest] & (np.arange(oldest) != shortlist[:, :, None])
        of_burst = cohort_level(np.where(counts, match[founder, burst][:, None], -np.inf), usual)
        of_member = cohort_level(np.where(counts[:, :, None], match[founder[:, None, None], member[..., None]], -np.inf), usual)
        is_one = np.isfinite(own)
        evidence = np.where(is_one, np.where(is_one, own, 0) - (of_burst[:, :, None] + of_member) / 2, 0.0)
        return np.asarray(evidence.sum(axis=2) / np.maximum(is_one.sum(axis=2), 1))
