"""Which members of a memory are near a burst, of all there are: one product with their mean pooled tokens, stacked.

Letters: D token size, Q queries.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from core.descriptors import unit
from core.views import FloatArray

CENTRE_PRIOR = 4.0
"""Members for which the shipped mean, which is zero, counts when the memory's own moves it; as of `core.evidence.ADAPTATION_PRIOR`."""


@dataclass(frozen=True)
class Listed:
    """A burst that was assigned to a category, by name."""

    id: str
    category_id: str


class Nearness:
    """Members in the order they came, oldest first; a category's first one is its founder."""

    def __init__(self) -> None:
        self.members: list[Listed] = []
        self._vectors = np.zeros((0, 0), dtype=np.float32)
        """Rows beyond the members are room for more."""
        self._of_category: dict[str, int] = {}
        self._centre = np.zeros(0, dtype=np.float32)
        self._lengths = np.zeros(0, dtype=np.float32)

    def __len__(self) -> int:
        return len(self.members)

    @property
    def founders(self) -> Mapping[str, int]:
        """By category, which member founded it."""
        return self._of_category

    def update(self, listed: Sequence[Listed], vectors: Callable[[Sequence[str]], Mapping[str, FloatArray]]) -> None:
        """Takes these members for those there are; `vectors` gives the mean pooled tokens, shape (D,), of members that are new, without
        those that take no part."""
        places = {member.id: place for place, member in enumerate(self.members)}
        new = vectors([member.id for member in listed if member.id not in places])
        kept = [member for member in listed if member.id in places or member.id in new]
        size = len(next(iter(new.values()))) if new else self._vectors.shape[1]
        stayed = [places[member.id] for member in kept if member.id in places]
        if stayed != list(range(len(self.members))) or any(member.id in places for member in kept[len(stayed) :]):
            self._vectors = self._ordered(kept, places, new, size)
        else:
            self._append([new[member.id] for member in kept[len(stayed) :]], len(stayed), size)
        self.members = kept
        self._of_category = {}
        for place, member in enumerate(kept):
            self._of_category.setdefault(member.category_id, place)
        self._centre_again()

    def nearest(self, queries: FloatArray, count: int) -> list[tuple[list[int], list[int]]]:
        """For each query, shape (Q, D): the `count` nearest members, and the founders of the `count` nearest categories, nearest first."""
        asked = unit(queries.astype(np.float32) - self._centre)
        stacked = self._vectors[: len(self.members)]
        cosines = (asked @ stacked.T - (asked @ self._centre)[:, None]) / self._lengths
        return [(self._nearest_members(row, count), self._founders_near(row, count)) for row in cosines]

    def _nearest_members(self, cosines: FloatArray, count: int) -> list[int]:
        if count >= len(cosines):
            return np.argsort(-cosines, kind="stable").tolist()
        best = np.argpartition(-cosines, count)[:count]
        return best[np.argsort(-cosines[best], kind="stable")].tolist()

    def _founders_near(self, cosines: FloatArray, count: int) -> list[int]:
        """A category is as near as its nearest member; ever more members are looked at until there are enough categories."""
        looked = 2 * count
        while True:
            categories = dict.fromkeys(self.members[place].category_id for place in self._nearest_members(cosines, looked))
            if len(categories) >= count or looked >= len(cosines):
                return [self._of_category[category] for category in categories][:count]
            looked *= 4

    def _ordered(self, kept: Sequence[Listed], places: Mapping[str, int], new: Mapping[str, FloatArray], size: int) -> NDArray[np.float32]:
        rows = [self._vectors[places[member.id]] if member.id in places else new[member.id] for member in kept]
        return np.array(rows, dtype=np.float32).reshape(len(kept), size)

    def _append(self, rows: Sequence[FloatArray], before: int, size: int) -> None:
        if before + len(rows) > len(self._vectors):
            room = np.empty((before + max(len(rows), before // 4), size), dtype=np.float32)
            room[:before] = self._vectors[:before].reshape(before, size)
            self._vectors = room
        for offset, row in enumerate(rows):
            self._vectors[before + offset] = row

    def _centre_again(self) -> None:
        stacked, count = self._vectors[: len(self.members)], len(self.members)
        self._centre = (stacked.sum(axis=0, dtype=np.float64) / (count + CENTRE_PRIOR)).astype(np.float32)
        squares = np.einsum("nd,nd->n", stacked, stacked) - 2 * (stacked @ self._centre) + self._centre @ self._centre
        self._lengths = np.sqrt(squares.clip(1e-12))
