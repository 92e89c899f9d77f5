"""Patch matches between every two bursts, adapted as a memory of a few bursts, and of many, would adapt them.

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
from core.evidence import Adaptation, match_views, sample_patches, whitened
from core.views import FloatArray

STAGES = (0, 8, 32)
"""Bursts that a memory holds at least for a stage; with fewer than the second it has the shipped statistics."""


def matches(bursts: Sequence[EncodedBurst], whitening: Whitening | None, folder: Path | None = None) -> FloatArray:
    """Match of bursts i and j, shape (S, N, N), symmetric; kept in the user's cache."""
    patches = [whitened(sample_patches(burst), whitening) for burst in bursts]
    file = (folder or cache_folder() / "matches") / f"{_key(patches)}.npy"
    if not file.exists():
        adaptations = [adapted(patches, count) for count in STAGES]
        with bar() as progress:
            task = progress.add_task("matching patches", total=len(adaptations) * len(patches))
            table = np.stack([match_table(patches, each, lambda: progress.advance(task)) for each in adaptations])
        write(file, lambda stream: np.save(stream, table))
    return np.asarray(np.load(file))


def adapted(patches: Sequence[FloatArray], count: int) -> Adaptation:
    """To as many of the bursts, drawn at random: in an episode they would be those that came first."""
    order = np.random.default_rng(0).permutation(len(patches))[:count]
    return Adaptation.fit([patches[index] for index in order]) if count else Adaptation.none(patches[0].shape[-1])


def match_table(patches: Sequence[FloatArray], adaptation: Adaptation, advance: Callable[[], None] | None = None) -> FloatArray:
    """Of the whitened patches of N bursts, shape (N, N); `advance` is called after each row."""
    unit = [adaptation.directions(each) for each in patches]
    table = np.zeros((len(unit), len(unit)))
    for row, each in enumerate(unit):
        table[row, row:] = table[row:, row] = match_views(each, unit[row:])
        if advance:
            advance()
    return table


def _key(patches: list[FloatArray]) -> str:
    digest = hashlib.sha256(f"{code_hash(('evidence.py',))} {STAGES}".encode())
    for each in patches:
        digest.update(each.tobytes())
    return digest.hexdigest()[:32]
