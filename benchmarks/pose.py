"""Accuracy of the 7-D pose between instances of a category: the paper's experiment on any data set with true poses.

A seeded sample of the ordered pairs of different instances of each category is estimated, with the product's own crop, and
with ground truth only for scoring. A pose that the estimator refuses counts as 180°. A row is one category, or "all": the
mean over categories (paper, "Multi-view one-shot pose estimation").
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import lru_cache
from itertools import groupby
from pathlib import Path

import numpy as np

from benchmarks.box_iou import Parallelepiped, box_iou
from benchmarks.contenders import Found, Setting, Sweep
from benchmarks.encoded import read_views
from benchmarks.pair_jobs import encode_pairs, seen_views
from benchmarks.pairs import UNPOSED, Pair, require_views, sample_pairs
from benchmarks.parallel import map_jobs, worker_count
from benchmarks.tables import report
from clients.datasets import folders
from clients.datasets.sources import find_sequences
from clients.pose_error import NO_POSE, PoseError, accuracy, median, pose_error, rotation_error_deg
from core.backbones import load_backbone
from core.boxes import remove_outliers
from core.encode import EncodedBurst, Encoder
from core.sim3 import Sim3
from core.views import FloatArray

DEFAULT_LIMIT = 30
"""Pairs a category."""


@dataclass(frozen=True)
class Job:
    """One reference and its targets: what a worker does in one go."""

    setting: Setting
    reference: folders.Sequence
    targets: tuple[folders.Sequence, ...]
    files: dict[str, Path]
    """The encoded views of each sequence, by its key."""
    seed: int


@dataclass(frozen=True)
class JobResult:
    """What came of a job's targets, in order, and the size of its reference."""

    job: Job
    errors: tuple[PoseError, ...]
    ious: tuple[float, ...]
    dofs: tuple[int, ...]
    """0 for a refused pose."""
    solve_ms: tuple[float, ...]
    memory_mb: float


@dataclass(frozen=True)
class PoseRow:
    """One line of the table."""

    variant: str
    views: str
    dims: int
    category: str
    pairs: int
    acc30: float
    acc15: float
    acc7_5: float
    median_deg: float
    median_t: float
    """Fraction of the target's diagonal."""
    median_log_scale: float
    median_iou: float
    """Of the box around the reference, carried by the estimate, and the target's, percent; both along the model's axes."""
    median_t_2pi: float | None
    """Median translation error where the target's longest side counts as 2π, as in CO3D (paper, "Translation estimation performance").
    This and the next three are None where the data do not tell the longest side, or there is no translation."""
    acc_t1_0: float | None
    acc_t0_5: float | None
    """Percentage of estimates whose centre is at most this far off, in the same unit."""
    acc_t0_2: float | None
    solve_ms: float
    """Median time of one estimate, one thread, features and reference already there."""
    memory_mb: float
    """Mean size of a reference's arrays."""
    answered: float
    """Percentage that got a pose, of as many degrees of freedom as asked for."""
    method: str | None
    """How patches are matched; None, here and below, where a contender has no such setting."""
    consensus_deg: float | None
    inlier_ratio: float | None
    estimator: str | None
    dof: int | None
    """5 is a rotation and a direction."""


COLUMNS = tuple(field.name for field in fields(PoseRow))
OPTIONS = COLUMNS[COLUMNS.index("method") :]
"""Printed where they differ between rows of a variant."""
TRANSLATION = ("median_t_2pi", "acc_t1_0", "acc_t0_5", "acc_t0_2")
"""Printed where there are any."""
MEAN_COLUMNS = COLUMNS[COLUMNS.index("acc30") : COLUMNS.index("method")]
"""What an "all" row averages over categories."""


def run(data: Path, sweep: Sweep, limit: int | None, json: Path | None, seed: int, backbone: str) -> list[PoseRow]:
    """Estimates the pairs of `data` under every setting of `sweep`; prints and returns the table.

    Args:
        limit: pairs a category at most; DEFAULT_LIMIT where None.
        json: where `{"meta", "rows"}` is written too.

    Raises InvalidInput for a setting that does not exist, or data without pairs, ground truth or enough views.
    """
    rows, meta = measure(data, [sweep], limit, seed, backbone)
    differing = [name for name in OPTIONS if len({(row.variant, getattr(row, name)) for row in rows}) > len(set(sweep.variants))]
    hidden = {*OPTIONS, *(name for name in TRANSLATION if all(getattr(row, name) is None for row in rows))}
    report(f"Pose, {data}", rows, meta, json, [*(name for name in COLUMNS if name not in hidden), *differing])
    return rows


def measure(data: Path, sweeps: Sequence[Sweep], limit: int | None, seed: int, backbone: str) -> tuple[list[PoseRow], dict[str, object]]:
    """The rows of every setting of `sweeps`, in order, and what they depend on besides. See `run`."""
    network = load_backbone(backbone)
    settings = list(dict.fromkeys(setting for sweep in sweeps for setting in sweep.settings(network.dim)))
    pairs = sample_pairs(find_sequences(data), DEFAULT_LIMIT if limit is None else limit, seed)
    require_views([sequence for pair in pairs for sequence in pair], [setting.views for setting in settings])
    files = encode_pairs(pairs, Encoder(network))
    by_setting = [_jobs(setting, pairs, files, seed) for setting in settings]
    jobs = [job for jobs_of_reference in zip(*by_setting) for job in jobs_of_reference]  # what one has read serves the next
    started = time.perf_counter()
    results = map_jobs(solve, jobs, lambda job: len(job.targets), "solving")
    meta = {
        "benchmark": "pose",
        "data": data,
        "seed": seed,
        "limit": limit,
        "backbone": network.name,
        "fingerprint": network.fingerprint,
        "options": [asdict(sweep) for sweep in sweeps],
        "solve_seconds": time.perf_counter() - started,
        "workers": worker_count(len(jobs)),
        "threads_per_worker": 1,
    }
    groups = [[result for result in results if result.job.setting == setting] for setting in settings]
    return [row for setting, group in zip(settings, groups, strict=True) for row in table_rows(setting, group)], meta


def solve(job: Job) -> JobResult:
    """Builds a job's reference and estimates the pose of each of its targets."""
    way = job.setting.contender
    kept, memory_mb = way.learn(_select(job, job.reference, "reference", job.setting.views.reference))
    scores, solve_ms = [], []
    for sequence in job.targets:
        target = _select(job, sequence, "target", job.setting.views.target)
        started = time.perf_counter()
        try:
            found = way.find(kept, target, job.seed)
        except UNPOSED:
            found = None
        solve_ms.append(1000 * (time.perf_counter() - started))
        scores.append(_score(found, job, sequence))
    errors, ious, dofs = zip(*scores, strict=True)
    return JobResult(job, errors, ious, dofs, tuple(solve_ms), memory_mb)


def table_rows(setting: Setting, results: Sequence[JobResult]) -> list[PoseRow]:
    """One row for each category, sorted, and the "all" row: the mean over categories."""
    ordered = sorted(results, key=lambda result: result.job.reference.category)
    groups = groupby(ordered, key=lambda result: result.job.reference.category)
    rows = [_category_row(setting, category, list(group)) for category, group in groups]
    means = {column: _mean([getattr(row, column) for row in rows]) for column in MEAN_COLUMNS}
    return [*rows, replace(rows[0], category="all", pairs=sum(row.pairs for row in rows), **means)]  # type: ignore[arg-type]


def _mean(values: Sequence[float | None]) -> float | None:
    """None where one of them is."""
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if len(known) == len(values) else None


def _category_row(setting: Setting, category: str, results: Sequence[JobResult]) -> PoseRow:
    errors = [error for result in results for error in result.errors]
    options = setting.contender.options
    return PoseRow(
        variant=setting.contender.variant,
        views=setting.views.text,
        dims=setting.contender.dims,
        category=category,
        pairs=len(errors),
        acc30=accuracy(errors, 30),
        acc15=accuracy(errors, 15),
        acc7_5=accuracy(errors, 7.5),
        median_deg=median(errors, "rotation_deg"),
        median_t=median(errors, "translation"),
        median_log_scale=median(errors, "log_scale"),
        median_iou=100 * float(np.median([iou for result in results for iou in result.ious])),
        **_translation_figures(results),
        solve_ms=float(np.median([ms for result in results for ms in result.solve_ms])),
        memory_mb=float(np.mean([result.memory_mb for result in results])),
        answered=100 * float(np.mean([dof == options.dof for result in results for dof in result.dofs])),
        method=options.method,
        consensus_deg=options.consensus_deg,
        inlier_ratio=options.inlier_ratio,
        estimator=options.estimator,
        dof=options.dof,
    )


def _translation_figures(results: Sequence[JobResult]) -> dict[str, float | None]:
    """The translation columns of a row: errors in units of which the target's longest side has 2π."""
    targets = [each for result in results for each in zip(result.job.targets, result.errors, strict=True)]
    sizes = [(sequence.world_from_model.scale if sequence.world_from_model else None, sequence.longest_side_m) for sequence, _ in targets]
    ratios = [scale / longest for scale, longest in sizes if scale and longest]
    if len(ratios) < len(targets) or np.isnan([error.translation for _, error in targets]).any():
        return dict.fromkeys(TRANSLATION)
    distances = 2 * np.pi * np.array([error.translation for _, error in targets]) * ratios
    within = [100 * float((distances <= limit).mean()) for limit in (1.0, 0.5, 0.2)]
    return dict(zip(TRANSLATION, [float(np.median(distances)), *within], strict=True))


def _jobs(setting: Setting, pairs: Sequence[Pair], files: dict[str, Path], seed: int) -> list[Job]:
    targets: dict[folders.Sequence, list[folders.Sequence]] = {}
    for reference, target in pairs:
        targets.setdefault(reference, []).append(target)
    return [Job(setting, reference, tuple(group), files, seed) for reference, group in targets.items()]


def _select(job: Job, sequence: folders.Sequence, role: str, count: int | None) -> EncodedBurst:
    return seen_views(sequence, job.files[sequence.key], role, count, job.seed)


def _score(found: Found | None, job: Job, sequence: folders.Sequence) -> tuple[PoseError, float, int]:
    """Errors, IoU of the boxes, and degrees of freedom, against ground truth."""
    reference_from_model, target_from_model = job.reference.world_from_model, sequence.world_from_model
    assert reference_from_model, "sample_pairs requires ground truth"
    assert target_from_model, "sample_pairs requires ground truth"
    if found is None:
        return NO_POSE, 0.0, 0
    if found.similarity is None or found.matrix is None:
        off = rotation_error_deg(found.rotation, reference_from_model, target_from_model, sequence.symmetries)
        return PoseError(off, np.nan, np.nan), np.nan, found.dof
    error = pose_error(found.similarity, reference_from_model, target_from_model, sequence.symmetries)
    truth = _model_box(job, sequence, target_from_model)
    carried = _model_box(job, job.reference, reference_from_model).carried_by(found.matrix)
    return error, box_iou(carried, truth), found.dof


def _model_box(job: Job, sequence: folders.Sequence, world_from_model: Sim3) -> Parallelepiped:
    """Around all that was measured of an object, along its model's axes, in its world."""
    cloud = _measured(job.files[sequence.key])
    return Parallelepiped.around(world_from_model.inverse().apply(cloud)).carried_by(world_from_model.as_matrix())


@lru_cache(maxsize=16)
def _measured(file: Path) -> FloatArray:
    """The cloud of all views without outliers."""
    return remove_outliers(read_views(file).cloud_m)
