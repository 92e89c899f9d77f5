"""Known or novel: the paper's continual setting on any folder in the data layout, for every score side by side.

Works on images alone; where there is depth and cameras, `best` also verifies by pose. See `benchmarks.episodes` for what counts as an
error and `benchmarks.calibrated` for the threshold that comes from a rate.

Letters: N bursts, T thresholds or rates.
"""

from __future__ import annotations

import operator
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from benchmarks import calibrated
from benchmarks.agreements import agreements
from benchmarks.best_pairs import BestPairs, BestSource
from benchmarks.discovery_plot import plot
from benchmarks.encoded import encode_all, read_views
from benchmarks.episodes import Counts, SetSource, Source, draw_orders, episode, labels_of, nearest_category
from benchmarks.matches import matches
from benchmarks.pair_scores import PairScores, auroc, hardest, nearest_accuracy, same_and_other
from benchmarks.parallel import map_jobs
from benchmarks.tables import Row, print_table, write_json
from benchmarks.thresholds import default_threshold, threshold_grid
from clients.datasets.sources import find_sequences
from core.backbones import load_backbone
from core.backbones.whitening import Whitening
from core.calibration import Prior
from core.encode import EncodedBurst, Encoder
from core.scores import BEST, SCORES, require_score
from core.views import FloatArray

JOB_EPISODES = 10
"""Episodes that a worker does in one go."""
BAND = (0.05, 0.95)
"""Of the episodes, which share of them the band around a curve holds."""
TOKENS = "best, tokens alone"
"""`best` as it is without depth."""
EASIER = "best, one object less"
"""`best` without the object that is hardest to tell from another kind: how much of the error is that one's."""
SUMMARY = (
    "score",
    "auroc",
    "nearest",
    "nearest_category",
    "fn_at_zero_fp",
    "fn_at_one_fp",
    "default_threshold",
    "default_fp",
    "default_fn",
    "repeat_error",
)
RATE_COLUMNS = (
    "score",
    "asked_percent",
    "new_false_known",
    "false_known_percent",
    "unknown_uncertain",
    "mistaken",
    "fp",
    "fn",
    "held_uncertain",
    "categories",
)

Total = TypeVar("Total", Counts, calibrated.Answers)


@dataclass(frozen=True, eq=False)
class Job:
    """Some episodes of one score."""

    pairs: PairScores | BestPairs
    labels: NDArray[np.intp]
    """The true category of each burst, shape (N,)."""
    orders: list[list[int]]
    """The bursts of each episode."""
    thresholds: FloatArray
    """Thresholds of a curve, or rates, shape (T,)."""


@dataclass(frozen=True)
class Found:
    """What the episodes came to."""

    rows: list[Row]
    """Of `score_rows`."""
    rates: list[Row]
    """Of `rate_rows`; none without `best`."""
    hardest: int | None
    """The burst that EASIER goes without; None without `best`, and where no two objects of a kind would be left."""


def run(
    data: Path,
    scores: Sequence[str],
    json: Path | None,
    *,
    episodes: int,
    length: int,
    seed: int,
    backbone: str,
    picture: Path | None,
    poses: bool,
) -> list[Row]:
    """Runs `episodes` episodes of `length` bursts of `data` for every score (all of them where none is named).

    Prints one summary line a score, and for `best` one for each false-known rate. Returns, and writes to `json`, rows of FP and FN
    against threshold with one summary row a score. `picture` gets the curves. Without `poses`, `best` decides by tokens alone.

    Raises InvalidInput for an unknown score, or data without two categories or without two objects of one.
    """
    for score in scores:
        require_score(score)
    sequences = find_sequences(data)
    labels = labels_of(sequences)
    network = load_backbone(backbone)
    tables = _all_tables(encode_all(sequences, Encoder(network)), network.whitening, scores, poses)
    started = time.perf_counter()
    found = measure(tables, labels, lambda labels: draw_orders(episodes, labels, length, seed))
    meta = {
        "benchmark": "discovery",
        "data": data,
        "seed": seed,
        "episodes": episodes,
        "length": length,
        "sequences": len(sequences),
        "categories": int(labels.max()) + 1,
        "backbone": network.name,
        "fingerprint": network.fingerprint,
        "hardest": None if found.hardest is None else sequences[found.hardest].name,
        "episode_seconds": time.perf_counter() - started,
    }
    if json is not None:
        write_json(json, meta, found.rows + found.rates)
    if picture is not None:
        plot(picture, found.rows, f"{data.name}: {episodes} episodes of {length} of {len(sequences)} bursts")
    print_table(f"Discovery, {data}: {episodes} episodes of {length}", [row for row in found.rows if "auroc" in row], SUMMARY)
    if found.rates:
        print_table("Threshold from a false-known rate", found.rates, RATE_COLUMNS)
    return found.rows + found.rates


def measure(
    tables: Mapping[str, PairScores | BestPairs], labels: NDArray[np.intp], draw: Callable[[NDArray[np.intp]], list[list[int]]]
) -> Found:
    """Episodes of every score, and of `best` without the hardest burst where one can go; `draw` gives orders for labels, shape (N,)."""
    orders = draw(labels)
    rows = [row for name, table in tables.items() for row in score_rows(name, table, labels, orders)]
    best = tables.get(BEST)
    if not isinstance(best, BestPairs):
        return Found(rows, [], None)
    rates = rate_rows(BEST, best, labels, orders)
    left_out = hardest(best.single(), labels)
    fewer, easier = np.delete(labels, left_out), best.without(left_out)
    if np.bincount(fewer).max() < 2:
        return Found(rows, rates, None)
    fewer_orders = draw(fewer)
    rows += score_rows(EASIER, easier, fewer, fewer_orders)
    return Found(rows, rates + rate_rows(EASIER, easier, fewer, fewer_orders), left_out)


def _all_tables(
    files: Sequence[Path], whitening: Whitening | None, scores: Sequence[str], poses: bool
) -> dict[str, PairScores | BestPairs]:
    """Of encoded bursts, by score; `best` twice where poses can verify it."""
    bursts = [read_views(file) for file in files]
    tables: dict[str, PairScores | BestPairs] = {**pair_tables(bursts, scores)}
    if scores and BEST not in scores:
        return tables
    best = BestPairs(matches(bursts, whitening), agreements(files, whitening) if poses else None, Prior.shipped())
    alone = replace(best, agreement=None)
    return tables | ({BEST: best, TOKENS: alone} if has_poses(best) else {BEST: alone})


def pair_tables(bursts: Sequence[EncodedBurst], scores: Sequence[str]) -> dict[str, PairScores]:
    """Of the scores that are named, or of all; `best` has tables of its own."""
    return {name: PairScores.of(bursts, SCORES[name]) for name in scores or SCORES if name != BEST}


def has_poses(pairs: BestPairs) -> bool:
    """Whether any pair of bursts could be laid on each other."""
    return pairs.agreement is not None and bool(np.isfinite(pairs.agreement).any())


def score_rows(name: str, pairs: PairScores | BestPairs, labels: NDArray[np.intp], orders: list[list[int]]) -> list[Row]:
    """A row for each threshold, ascending, then the summary row; labels and orders as of `Job`."""
    single, own = pairs.single(), default_threshold(name, pairs)
    thresholds = threshold_grid(name, pairs, single, own)
    counts = sum_jobs(run_episodes, pairs, labels, orders, thresholds, name)
    fp, fn, repeat = counts.fp, counts.fn, counts.repeat_error
    fp_band, fn_band = counts.bands(*BAND)
    curve: list[Row] = [
        {
            "score": name,
            "threshold": float(threshold),
            "fp": float(fp[t]),
            "fn": float(fn[t]),
            "fp_band": fp_band[:, t].tolist(),
            "fn_band": fn_band[:, t].tolist(),
            "repeat_error": float(repeat[t]),
        }
        for t, threshold in enumerate(thresholds)
    ]
    at_zero = min((t for t in range(len(thresholds)) if fp[t] == 0), key=lambda t: (fn[t], t))
    at_one = min((t for t in range(len(thresholds)) if fp[t] <= 1), key=lambda t: (fn[t], t))
    default = int(np.abs(thresholds - own).argmin())
    same, other = same_and_other(single, labels)
    summary: Row = {
        **curve[at_zero],
        "auroc": auroc(same, other),
        "nearest": nearest_accuracy(single, labels),
        "nearest_category": nearest_category(source_of(pairs, int(labels.max()) + 1), labels),
        "fn_at_zero_fp": float(fn[at_zero]),
        "fn_at_one_fp": float(fn[at_one]),
        "default_threshold": own,
        "default_fp": float(fp[default]),
        "default_fn": float(fn[default]),
        "categories_at_one_fp": (counts.categories[at_one] / len(orders)).round(2).tolist(),
        "true_categories": (counts.truth / len(orders)).round(2).tolist(),
    }
    return [*curve, summary]


def rate_rows(name: str, pairs: BestPairs, labels: NDArray[np.intp], orders: list[list[int]]) -> list[Row]:
    """What was asked for and what came of it, a row for each rate, in percent; labels and orders as of `Job`."""
    answers = sum_jobs(run_calibrated, pairs, labels, orders, np.array(calibrated.RATES), f"{name}, calibrated")

    def percent(part: str, *whole: str) -> FloatArray:
        return np.asarray(
            100 * getattr(answers, part).sum(axis=0) / np.maximum(sum(getattr(answers, each) for each in whole).sum(axis=0), 1)
        )

    columns = {
        "new_false_known": percent("new_false_known", "new"),
        "false_known_percent": percent("false_known", "unknown"),
        "unknown_uncertain": percent("unknown_uncertain", "unknown"),
        "mistaken": percent("mistaken", "holding"),
        "fp": percent("false_known", "unknown", "holding") + percent("mistaken", "unknown", "holding"),
        "fn": percent("missed", "holding"),
        "held_uncertain": percent("holding_uncertain", "holding"),
        "categories": answers.categories.mean(axis=0),
    }
    asked = [100 * rate for rate in calibrated.RATES]
    return [{"score": name, "asked_percent": asked[t]} | {key: float(each[t]) for key, each in columns.items()} for t in range(len(asked))]


def sum_jobs(
    function: Callable[[Job], Total],
    pairs: PairScores | BestPairs,
    labels: NDArray[np.intp],
    orders: list[list[int]],
    thresholds: FloatArray,
    name: str,
) -> Total:
    """What `function` counts over all orders, in parallel; labels and thresholds as of `Job`, `name` is what progress is reported of."""
    chunks = [orders[start : start + JOB_EPISODES] for start in range(0, len(orders), JOB_EPISODES)]
    return total(map_jobs(function, [Job(pairs, labels, chunk, thresholds) for chunk in chunks], lambda job: len(job.orders), name))


def total(parts: Sequence[Total]) -> Total:
    """The sum of at least one part."""
    return reduce(operator.add, parts)


def source_of(pairs: PairScores | BestPairs, room: int) -> Source:
    """A memory with room for so many categories."""
    return BestSource(pairs, room) if isinstance(pairs, BestPairs) else SetSource(pairs, room)


def run_episodes(job: Job) -> Counts:
    """The counts of a job's episodes together."""
    source = source_of(job.pairs, len(job.orders[0]))
    return total([episode(source, job.labels, order, job.thresholds) for order in job.orders])


def run_calibrated(job: Job) -> calibrated.Answers:
    """The same with thresholds from rates."""
    assert isinstance(job.pairs, BestPairs)
    return total([calibrated.episode(job.pairs, job.labels, order, job.thresholds.tolist()) for order in job.orders])
