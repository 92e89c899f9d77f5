"""The members of a memory, kept ready from decision to decision: one takes the time of a few comparisons, however many members there are.

Up to EXACT members each is compared part by part, which is the rule (`core.evidence.Comparison.between`); what does not depend on the
burst is computed once. Of a larger memory the burst is compared with the mean pooled token of every member first, and part by part with
the nearest members, the founders of the nearest categories and the cohort alone.

Letters: V views, K parts a view, D token size.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from itertools import islice
from typing import Protocol, TypeVar

import numpy as np
import torch
from torch import Tensor

from core.backbones.whitening import Whitening
from core.encode import EncodedBurst
from core.evidence import COHORT, Adaptation, Comparison, Usual, match_views, part_tokens, whitened
from core.nearness import Listed, Nearness
from core.views import FloatArray

T = TypeVar("T")

EXACT = 64
"""Members up to which every one is compared part by part: about 20 ms on two cores with ten views a side."""
NEAREST = 12
"""So many members, and founders of so many categories, are compared part by part in a larger memory, beside the cohort."""
ADAPTED_FROM = 256
"""Members, evenly spaced, whose parts a larger memory is adapted to; more say nothing new."""
GROWTH = 1.25
"""Factor by which a larger memory grows until it is adapted anew, whereupon nothing that was kept holds any longer."""
ROUNDING = 1e-9
"""Added to a logarithm before it is rounded down: a memory that has just grown by GROWTH counts as grown."""
KEPT = 512
"""Members whose parts stay in memory, those compared last: up to 100 MB of ten views each."""
KEPT_COHORTS = 4096
"""Members whose matches with founders stay in memory: about 10 MB."""


class Source(Protocol):
    """Where the tokens are; none are asked for that no decision needs."""

    def listed(self) -> Sequence[Listed]:
        """All members, oldest first; the same object while nothing has changed."""

    def pooled_means(self, ids: Sequence[str]) -> Mapping[str, FloatArray]:
        """By id, the mean over views of a member's pooled tokens, shape (D,); without those that have no parts, or are damaged."""

    def parts(self, ids: Sequence[str]) -> Mapping[str, FloatArray]:
        """By id, of `core.evidence.part_tokens`, shape (V, K, D); without those that are damaged."""


class Enrolled:
    """The members of one memory, kept ready. Safe to use from several threads, one of which is served at a time."""

    def __init__(self, source: Source, whitening: Whitening | None) -> None:
        self._source, self._whitening = source, whitening
        self._lock = threading.Lock()
        self._listed: Sequence[Listed] = ()
        self._left_out: set[str] = set()
        """Ids of damaged members."""
        self._near = Nearness()
        self._adapted_to: list[str] = []
        self._matrix, self._offset = torch.zeros(0, 0), torch.zeros(0)
        self._parts: _Latest[Tensor] = _Latest(KEPT)
        self._cohorts: _Latest[dict[str, float]] = _Latest(KEPT_COHORTS)
        """By member, its matches with founders, by the founder's id."""

    def compare(self, target: EncodedBurst, usual: Usual) -> Comparison | None:
        """A burst with all members, or the nearest; None where there is no member. `usual` as of `Comparison`."""
        with self._lock:
            self._update(self._source.listed())
            while len(self._near):
                try:
                    return self._compare(target, usual)
                except _DamagedError as error:
                    self._left_out |= error.ids
                    self._enrol(self._listed)
            return None

    @property
    def exact(self) -> bool:
        """Whether every member is compared part by part."""
        return len(self._near) <= EXACT

    def _update(self, listed: Sequence[Listed]) -> None:
        if listed is not self._listed:
            self._enrol(listed)
            self._listed = listed  # last: where enrolling fails the next decision tries again

    def _enrol(self, listed: Sequence[Listed]) -> None:
        self._near.update([member for member in listed if member.id not in self._left_out], self._source.pooled_means)

    def _compare(self, target: EncodedBurst, usual: Usual) -> Comparison:
        self._adapt()
        near = self._near
        if self.exact:
            chosen = list(range(len(near)))
        else:
            ((closest, of_near),) = near.nearest(target.pooled.mean(axis=0)[None], NEAREST)
            chosen = sorted({*closest, *of_near, *islice(near.founders.values(), COHORT)})
        found = match_views(self._directions([part_tokens(target)])[0], self._prepared(chosen))
        return Comparison.of(
            [near.members[place].category_id for place in chosen],
            found,
            lambda index, founders: self._with_founders(chosen[index], [chosen[each] for each in founders]),
            usual,
        )

    def _with_founders(self, place: int, founders: Sequence[int]) -> list[float]:
        """A member's matches with founders; each is compared once."""
        members = self._near.members
        known = self._cohorts.keep(members[place].id, self._cohorts.get(members[place].id, {}))
        missing = [each for each in founders if members[each].id not in known]
        if missing:
            matches = match_views(self._prepared([place])[0], self._prepared(missing))
            known.update(zip((members[each].id for each in missing), matches.tolist()))
        return [known[members[each].id] for each in founders]

    def _prepared(self, places: Sequence[int]) -> list[Tensor]:
        """Unit parts of some members, adapted to the memory, each (V, K, D). Raises _DamagedError."""
        ids = [self._near.members[place].id for place in places]
        there = {each: self._parts[each] for each in ids if each in self._parts}
        missing = [each for each in ids if each not in there]
        if missing:
            read = self._read(missing)
            there.update(zip(missing, self._directions([read[each] for each in missing])))
        for each in ids:
            self._parts.keep(each, there[each])
        return [there[each] for each in ids]

    def _read(self, ids: Sequence[str]) -> Mapping[str, FloatArray]:
        read = self._source.parts(ids) if ids else {}
        damaged = {each for each in ids if each not in read}
        if damaged:
            raise _DamagedError(damaged)
        return read

    def _directions(self, bursts: Sequence[FloatArray]) -> list[Tensor]:
        """`whitened` and `Adaptation.directions` in one product, for bursts of parts, each (V, K, D)."""
        tokens = torch.from_numpy(np.concatenate(bursts).astype(np.float32))
        adapted = torch.nn.functional.normalize(tokens @ self._matrix + self._offset, dim=-1)
        return list(torch.split(adapted, [len(burst) for burst in bursts]))

    def _adapt(self) -> None:
        """To all members of a small memory, at each change; to some of a larger one, after each quarter that it has grown by."""
        wanted = [self._near.members[place].id for place in adapted_from(len(self._near))]
        if wanted == self._adapted_to:
            return
        read = self._read(wanted)
        adaptation = Adaptation.fit([whitened(read[each], self._whitening) for each in wanted])
        matrix, offset = adaptation.matrix, -adaptation.mean @ adaptation.matrix
        if self._whitening is not None:
            shipped = self._whitening.matrix.astype(np.float64)
            matrix, offset = shipped @ matrix, offset - (self._whitening.mean @ shipped) @ adaptation.matrix
        self._matrix, self._offset = torch.from_numpy(matrix).float(), torch.from_numpy(offset).float()
        self._parts.clear()
        self._cohorts.clear()
        self._adapted_to = wanted


class _DamagedError(Exception):
    def __init__(self, ids: set[str]) -> None:
        super().__init__(f"{len(ids)} members are damaged")
        self.ids = ids


class _Latest(OrderedDict[str, T]):
    """A mapping that forgets what was kept longest ago, beyond so many entries."""

    def __init__(self, most: int) -> None:
        super().__init__()
        self._most = most

    def keep(self, key: str, value: T) -> T:
        """Keeps it as the latest, and returns it."""
        self[key] = value
        self.move_to_end(key)
        while len(self) > self._most:
            self.popitem(last=False)
        return value


def adapted_from(count: int) -> list[int]:
    """Places of the members that a memory of so many is adapted to: all of a small one, of a larger one the same until it has grown by
    GROWTH."""
    if count <= EXACT:
        return list(range(count))
    steps = int(np.floor(np.log(count / EXACT) / np.log(GROWTH) + ROUNDING))
    size = min(count, int(np.ceil(EXACT * GROWTH**steps)))
    return np.unique(np.linspace(0, size - 1, min(size, ADAPTED_FROM)).astype(int)).tolist()
