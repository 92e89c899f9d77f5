"""Matches between every two bursts, adapted as a memory of a few bursts, and of many, would adapt them.

Letters: N bursts, S stages.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from benchmarks.cached import code_hash, write
from benchmarks.parallel import bar
from core.backbones.weights import cache_folder
from core.backbones.whitening import Whitening
from core.encode import EncodedBurst
from core.evidence import Adaptation, match_views, part_tokens, whitened
from core.views import FloatArray

STAGES = (0, 8, 32)
"""Bursts that a memory holds at least for a stage; with fewer than the second it has the shipped statistics."""


def matches(bursts: Sequence[EncodedBurst], whitening: Whitening | None, folder: Path | None = None) -> FloatArray:
    """Match of bursts i and j, shape (S, N, N), symmetric; kept in the user's cache."""
    parts = [whitened(part_tokens(burst), whitening) for burst in bursts]
    file = (folder or cache_folder() / "matches") / f"{_key(parts)}.npy"
    if not file.exists():
        adaptations = [adapted(parts, count) for count in STAGES]
        with bar() as progress:
            task = progress.add_task("matching parts", total=len(adaptations) * len(parts))
            table = np.stack([match_table(parts, each, lambda: progress.advance(task)) for each in adaptations])
        write(file, lambda stream: np.save(stream, table))
    return np.asarray(np.load(file))


def adapted(parts: Sequence[FloatArray], count: int) -> Adaptation:
    """To as many of the bursts, drawn at random: in an episode they would be those that came first."""
    order = np.random.default_rng(0).permutation(len(parts))[:count]
    return Adaptation.fit([parts[index] for index in order]) if count else Adaptation.none(parts[0].shape[-1])


def match_table(parts: Sequence[FloatArray], adaptation: Adaptation, advance: Callable[[], None] | None = None) -> FloatArray:
    """Of the whitened parts of N bursts, shape (N, N); `advance` is called after each row."""
    unit = [adaptation.directions(each) for each in parts]
    table = np.zeros((len(unit), len(unit)))
    for row, each in enumerate(unit):
        table[row, row:] = table[row:, row] = match_views(each, unit[row:])
        if advance:
            advance()
    return table


def _key(parts: list[FloatArray]) -> str:
    digest = hashlib.sha256(f"{code_hash(('evidence.py',))} {STAGES}".encode())
    for each in parts:
        digest.update(each.tobytes())
    return digest.hexdigest()[:32]
