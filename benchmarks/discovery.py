"""Known or novel: the paper's continual setting on any folder in the data layout, for every score side by side.

Works on images alone; no depth and no cameras are needed. See `benchmarks.episodes` for what counts as an error.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.encoded import encode_all, read_encoded
from benchmarks.episodes import Counts, draw_orders, episode
from benchmarks.pair_scores import PARTS, FloatArray, PairScores, auroc
from benchmarks.parallel import map_jobs
from benchmarks.tables import Row, print_table, write_json
from clients.datasets.sources import find_sequences
from core.backbones.dino import load_backbone
from core.encode import Encoder
from core.errors import InvalidInput
from core.novelty import named_score

LEVELS = np.concatenate([np.linspace(0, 0.9, 20), 1 - np.geomspace(0.1, 0.001, 30), [1.0]])
"""Quantiles of the similarities between bursts at which a curve has a threshold: dense at the top, where the errors trade."""
SUMS = 30
"""Further thresholds of a sum, which grows with the members of a category."""
SUM_REACH = 10.0
"""How far those reach: the sum over all bursts, each presented this often."""
JOB_EPISODES = 5
"""Episodes that a worker does in one go."""
TINY = 1e-3
"""Added to the largest similarity there can be, so that a curve ends with everything novel."""
SUMMARY = ("score", "auroc", "nearest", "fn_at_zero_fp", "fn_at_one_fp", "default_threshold", "default_fp", "default_fn")


@dataclass(frozen=True, eq=False)
class Job:
    """Some episodes of one score."""

    pairs: PairScores
    labels: NDArray[np.intp]
    orders: list[list[int]]
    thresholds: FloatArray


def run(
    data: Path,
    scores: Sequence[str],
    json: Path | None,
    episodes: int = 100,
    length: int = 250,
    seed: int = 0,
    backbone: str = "dinov2-s14",
) -> list[Row]:
    """Runs `episodes` episodes of `length` bursts of `data` for every score (all of them where none is named).

    Prints one summary line a score. Returns, and writes to `json`, rows of FP and FN against threshold with one summary row a score.

    Raises InvalidInput for an unknown score, or data without two categories or without two objects of one.
    """
    for score in scores:
        named_score(score)
    sequences = find_sequences(data)
    names, labels = np.unique([sequence.category for sequence in sequences], return_inverse=True)
    if len(names) < 2 or np.bincount(labels).max() < 2:
        raise InvalidInput("data", "discovery needs two categories, and two objects of one of them")
    network = load_backbone(backbone)
    bursts = [read_encoded(file) for file in encode_all(sequences, Encoder(network))]
    orders = draw_orders(episodes, len(bursts), length, seed)
    started = time.perf_counter()
    rows: list[Row] = []
    for score in scores or PARTS:
        rows += score_rows(PairScores.of(bursts, score), labels, orders)
    seconds = time.perf_counter() - started
    summaries = [row for row in rows if "auroc" in row]
    if json is not None:
        meta = {
            "benchmark": "discovery",
            "data": data,
            "seed": seed,
            "episodes": episodes,
            "length": length,
            "sequences": len(sequences),
            "categories": len(names),
            "backbone": network.name,
            "fingerprint": network.fingerprint,
            "episode_seconds": seconds,
        }
        write_json(json, meta, rows)
    print_table(f"Discovery, {data}: {episodes} episodes of {length}", summaries, SUMMARY)
    return rows


def score_rows(pairs: PairScores, labels: NDArray[np.intp], orders: list[list[int]]) -> list[Row]:
    """A row for each threshold, ascending, then the summary row."""
    single, own = pairs.single(), named_score(pairs.score).threshold
    thresholds = threshold_grid(pairs, single, own)
    chunks = [orders[start : start + JOB_EPISODES] for start in range(0, len(orders), JOB_EPISODES)]
    jobs = [Job(pairs, labels, chunk, thresholds) for chunk in chunks]
    parts = map_jobs(run_episodes, jobs, lambda job: len(job.orders), pairs.score)
    counts = sum(parts[1:], start=parts[0])
    fp, fn = counts.fp, counts.fn
    curve = [
        {"score": pairs.score, "threshold": float(threshold), "fp": float(fp[t]), "fn": float(fn[t])}
        for t, threshold in enumerate(thresholds)
    ]
    at_zero = min((t for t in range(len(thresholds)) if fp[t] == 0), key=lambda t: (fn[t], t))
    default = int(np.abs(thresholds - own).argmin())
    same, other = same_and_other(single, labels)
    summary = {
        **curve[at_zero],
        "auroc": auroc(same, other),
        "nearest": nearest_accuracy(single, labels),
        "fn_at_zero_fp": float(fn[at_zero]),
        "fn_at_one_fp": float(fn[fp <= 1].min()),
        "default_threshold": own,
        "default_fp": float(fp[default]),
        "default_fn": float(fn[default]),
    }
    return [*curve, summary]


def run_episodes(job: Job) -> Counts:
    """The counts of a job's episodes together."""
    parts = [episode(job.pairs, job.labels, order, job.thresholds) for order in job.orders]
    return sum(parts[1:], start=parts[0])


def threshold_grid(pairs: PairScores, single: FloatArray, own: float) -> FloatArray:
    """Ascending thresholds, shape (T,): where similarities lie, the score's own, and one that nothing exceeds."""
    top = float(single.max())  # of a burst to itself
    grid = [np.quantile(single[~np.eye(len(single), dtype=bool)], LEVELS), [own, top + TINY]]
    if pairs.score == "paper_sum":
        grid.append(np.geomspace(top, pairs.total.sum(axis=0).max() * SUM_REACH + TINY, SUMS))
    return np.unique(np.concatenate(grid))


def same_and_other(single: FloatArray, labels: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
    """Similarities of pairs of different bursts: of the same category, and of two categories."""
    same = labels[:, None] == labels[None, :]
    different_bursts = ~np.eye(len(labels), dtype=bool)
    return single[same & different_bursts], single[~same]


def nearest_accuracy(single: FloatArray, labels: NDArray[np.intp]) -> float:
    """Share of bursts whose most similar other burst is of their category, of those that have one."""
    others = np.where(np.eye(len(labels), dtype=bool), -np.inf, single)
    has_other = np.bincount(labels)[labels] > 1
    right = labels[others.argmax(axis=0)] == labels
    return float(right[has_other].mean())
