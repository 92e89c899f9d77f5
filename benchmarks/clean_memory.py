"""What a memory of undegraded bursts makes of one burst: poses against its kind, and the decision with and without its kind."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path

import numpy as np

from benchmarks.agreements import SOURCES
from benchmarks.cached import code_hash, write
from benchmarks.encoded import read_encoded, read_views
from core.backbones.weights import cache_folder
from core.backbones.whitening import Whitening
from core.encode import EncodedBurst
from core.errors import InvalidInput, NoPose
from core.novelty import Context, Decision, Member, decide
from core.reference import Reference, build_reference
from core.sim3 import Sim3
from core.verification import verify
from core.view_consistency import consistent_only


@dataclass(frozen=True)
class Known:
    """One burst that the memory holds."""

    category: str
    file: Path
    """Its encoding."""
    views: tuple[int, ...]


@dataclass(frozen=True)
class Laid:
    """A reference laid on a burst."""

    target_from_reference: Sim3 | None
    """None where there is no pose."""
    agreement: float
    """See `core.verification`; 0 without a pose."""


@dataclass(frozen=True)
class Decisions:
    """What a burst was taken for."""

    own: float
    """Evidence for its category; −inf where that is not among the shortlisted."""
    rival: float
    """Evidence for the best category of a memory that does not hold its own."""
    right: bool
    """Known, and as what it is."""
    nearest: bool
    """The most similar category is its own, whatever the answer."""
    uncertain: bool
    novel: bool
    false_known: bool
    """Known, though its category was not in the memory."""


UNSEEN = Decisions(-np.inf, -np.inf, right=False, nearest=False, uncertain=False, novel=False, false_known=False)
"""Of a burst in which no object was found: the service refuses it."""


@dataclass(frozen=True)
class CleanMemory:
    """Undegraded bursts, and how they are posed and decided by."""

    bursts: tuple[Known, ...]
    """The first of a category is its reference."""
    whitening: Whitening | None
    seed: int
    poses: bool
    """Whether the poses of the likeliest categories' references verify decisions."""

    def lay(self, known: Known, target: Path) -> Laid:
        """The best pose of a burst that the memory holds on the encoding in `target`; kept in the user's cache."""
        names = f"{code_hash(SOURCES)} {known.file.stem} {known.views} {target.stem} {self.seed}"
        file = cache_folder() / "laid" / f"{hashlib.sha256(names.encode()).hexdigest()[:32]}.npz"
        if not file.exists():
            laid = _lay(known, consistent_only(read_encoded(target)), self.whitening, self.seed)
            matrix = np.zeros((4, 4)) if laid.target_from_reference is None else laid.target_from_reference.as_matrix()
            write(file, lambda stream: np.savez(stream, allow_pickle=False, matrix=matrix, agreement=laid.agreement))
        with np.load(file, allow_pickle=False) as arrays:
            matrix, found = arrays["matrix"], float(arrays["agreement"])
        return Laid(Sim3.from_matrix(matrix) if matrix.any() else None, found)

    def decide(self, target: Path, category: str) -> Decisions:
        """On the encoding in `target`, of an object of `category`: by all bursts, and by those that are left without this category."""
        burst = consistent_only(read_encoded(target))
        if not any(len(view.cells) for view in burst.views):
            return UNSEEN
        references: dict[str, Known] = {}
        for known in self.bursts:
            references.setdefault(known.category, known)

        def agreement(asked: str) -> float:
            return self.lay(references[asked], target).agreement

        def decision(bursts: Sequence[Known]) -> Decision:
            members = [_member(each) for each in bursts]
            return decide(members, burst, context=Context(self.whitening, verify=agreement if self.poses else None))

        held, without = decision(self.bursts), decision([each for each in self.bursts if each.category != category])
        nearest = held.similarities[0][0] == category
        return Decisions(
            own=dict(held.similarities).get(category, -np.inf),
            rival=without.similarity if without.similarity is not None else -np.inf,
            right=held.outcome == "known" and nearest,
            nearest=nearest,
            uncertain=held.outcome == "uncertain",
            novel=held.outcome == "novel",
            false_known=without.outcome == "known",
        )


def _lay(known: Known, burst: EncodedBurst, whitening: Whitening | None, seed: int) -> Laid:
    reference = _reference(known)
    try:
        estimate, found = verify(reference, burst, whitening, seed=seed)
    except (NoPose, InvalidInput):  # nothing of the reference is found, or the burst has no depth on the object
        return Laid(None, 0.0)
    return Laid(estimate.target_from_reference, found)


def _seen(known: Known) -> EncodedBurst:
    return read_views(known.file, list(known.views))


@lru_cache(maxsize=64)
def _reference(known: Known) -> Reference:
    return build_reference(_seen(known))


@cache
def _member(known: Known) -> Member:
    return Member.of(known.category, _seen(known))
