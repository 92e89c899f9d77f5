"""How well every burst's reference explains every other burst: poses solved once a pair, and kept in the user's cache.

Only bursts with depth and cameras have poses; the agreement of any other pair is NaN. A cached row is named by the encodings it was
computed from and by the source of the code that solves.

Letters: N bursts.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.cached import code_hash, write
from benchmarks.encoded import read_encoded
from benchmarks.parallel import map_jobs
from core.backbones.weights import cache_folder
from core.backbones.whitening import Whitening
from core.encode import EncodedBurst
from core.errors import OneLookError
from core.reference import Reference, build_reference
from core.verification import verify
from core.view_consistency import consistent_only
from core.views import FloatArray

VIEWS = 8
"""Of a longer burst so many, evenly spaced, stand for it: a robot's burst is about as long, and a solve takes less time."""
SOURCES = (
    "best_pose.py",
    "boxes.py",
    "correspond.py",
    "dense.py",
    "descriptors.py",
    "discriminant.py",
    "estimators/base.py",
    "estimators/batched.py",
    "estimators/ransac.py",
    "evidence.py",
    "hypotheses.py",
    "matched_pair.py",
    "matches.py",
    "pose.py",
    "pose_estimate.py",
    "reference.py",
    "sim3.py",
    "surface.py",
    "verification.py",
    "view_consistency.py",
    "viewpoints.py",
)
"""Files of core/ that decide what an agreement is: changed code never meets an old row."""


@dataclass(frozen=True)
class Job:
    """One target against all references."""

    files: tuple[Path, ...]
    target: int
    whitening: Whitening | None
    row: Path


def agreements(files: Sequence[Path], whitening: Whitening | None, folder: Path | None = None) -> FloatArray:
    """Agreement of reference i with burst j for the encodings in `files`, shape (N, N); NaN on the diagonal and where there is no depth."""
    root = folder or cache_folder() / "agreements"
    names = hashlib.sha256("\n".join(file.stem for file in files).encode()).hexdigest()[:16]
    jobs = [Job(tuple(files), j, whitening, root / f"{code_hash(SOURCES)[:16]}-{names}-{file.stem}.npy") for j, file in enumerate(files)]
    missing = [job for job in jobs if not job.row.exists()]
    if missing:
        map_jobs(compute_row, missing, lambda job: len(job.files) - 1, "verifying by pose")
    return np.stack([np.load(job.row) for job in jobs], axis=1)


def compute_row(job: Job) -> None:
    """Solves every reference against the job's target and writes the agreements, shape (N,)."""
    row = np.full(len(job.files), np.nan)
    target = few_views(read_encoded(job.files[job.target]))
    for i, file in enumerate(job.files):
        reference = _reference(file)
        if i == job.target or reference is None or not len(target.cloud_m):
            continue
        try:
            _, row[i] = verify(reference, target, job.whitening)
        except OneLookError:  # no pose: nothing of the reference is found in the burst
            row[i] = 0.0
    write(job.row, lambda stream: np.save(stream, row))


def few_views(burst: EncodedBurst) -> EncodedBurst:
    """At most VIEWS of the views that show an object, evenly spaced."""
    shown = [index for index, view in enumerate(burst.views) if len(view.cells)]
    chosen = np.unique(np.linspace(0, len(shown) - 1, min(VIEWS, len(shown))).round().astype(int))
    return consistent_only(burst.select([shown[index] for index in chosen]))


@cache
def _reference(file: Path) -> Reference | None:
    try:
        return build_reference(few_views(read_encoded(file)))
    except OneLookError:  # no depth, or one view only
        return None
