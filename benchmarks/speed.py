"""Speed: milliseconds of every stage of one observation, side by side in one run.

Operations take turns, round after round, so that whatever else the machine does falls on all of them alike; medians over the
rounds. A ratio compares with a whole observation: encode, and decide by `best` with all the poses that are ever tried, one of which is
the answer.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from io import BytesIO
from pathlib import Path

import numpy as np
import torch

from benchmarks import speed_plot, transformer_products, zero_shot_pose
from benchmarks.pairs import two_of_a_kind
from benchmarks.parallel import bar
from benchmarks.tables import print_table, report
from clients.datasets import folders
from clients.datasets.samples import data_or_samples
from clients.datasets.sources import find_sequences
from core.backbones import load_backbone
from core.backbones.base import Backbone
from core.backbones.dino import fast_dtype
from core.backbones.whitening import Whitening
from core.boxes import cloud_extent_m
from core.depth import complete
from core.encode import EncodedBurst, Encoder, EncoderConfig
from core.matched_pair import MatchedPair
from core.novelty import VERIFIED, Context, DecisionConfig, Member, decide
from core.pose import VARIANTS, PoseConfig, PoseEstimator
from core.reference import Reference, build_reference
from core.scores import BEST, SCORES
from core.verification import verify
from core.views import Burst

WARM_UP = 1
"""Rounds that are not counted: first calls allocate and load."""
Operation = Callable[[], dict[str, float]]
"""Does its work once and returns milliseconds by stage; an operation without stages returns none."""


@dataclass(frozen=True)
class SpeedRow:
    """One line of the table."""

    operation: str
    stage: str
    """`total`, or a part of the operation."""
    ms: float
    ratio: float
    """Share of a whole observation."""


@dataclass(frozen=True)
class TargetRow:
    """What was aimed at, as a ratio of two operations of the same run, or in milliseconds or megabytes."""

    target: str
    measured: float
    bound: str


VERIFIED_DECISION = f"decide {BEST}, {VERIFIED} poses"
OBSERVATION = ("encode", VERIFIED_DECISION)
"""What one observation of a known object consists of, with a service's defaults."""
STRAIGHTFORWARD = "encode, both passes whole, in single precision"
BARE = "encode, the bare products of both passes, whole"
NEAR = "encode, close crop near the object only"
PRODUCTS = "products of all patches"
RECIPE = "solve as zero-shot-pose does"
"""Operations that others are compared with."""
CONTEXT = 2
"""Patches around the object that NEAR sees as well."""
GROWING, MORE = ("ucd", "best"), 3
"""Variants that are timed with so many times the views as well."""


def run(
    json: Path | None,
    data: Path | None,
    *,
    views: int,
    rounds: int,
    backbone: str,
    device: str,
    plot: Path | None,
) -> list[SpeedRow]:
    """Times one observation of `views` views of an object of `data` (the samples where None) against a reference of as many.

    Raises InvalidInput where no category of `data` has two objects with so many views.
    """
    objects = two_of_a_kind(find_sequences(data_or_samples(data)), views)
    reference_burst, target_burst = (folders.load_burst(each, range(views)) for each in objects)
    network = load_backbone(backbone, device=device)
    exact = load_backbone(backbone, device=device, dtype=torch.float32)
    scanned = Encoder(network).encode(reference_burst)
    reference = build_reference(scanned)
    rows = table_rows(_rounds(_operations(network, exact, scanned, reference, target_burst, device), rounds), OBSERVATION)
    targets = [asdict(row) for row in target_rows(rows, _megabytes(reference))]
    meta = {
        "benchmark": "speed",
        "views": views,
        "rounds": rounds,
        "backbone": network.name,
        "device": device,
        "threads": torch.get_num_threads(),
        "targets": targets,
    }
    report(f"Speed, {views} + {views} views, {torch.get_num_threads()} threads", rows, meta, json)
    print_table("Against its bounds", targets, ("target", "measured", "bound"))
    if plot is not None:
        speed_plot.plot(plot, _waterfall(rows), f"{views} views against a reference of {views}, {torch.get_num_threads()} threads")
    return rows


def _operations(
    network: Backbone, exact: Backbone, scanned: EncodedBurst, reference: Reference, burst: Burst, device: str
) -> dict[str, Operation]:
    """What is timed, by its name: `burst` against the reference of what was scanned. `exact` is the same network in single precision."""
    encoder, near = Encoder(network), Encoder(network, EncoderConfig(context=CONTEXT))
    straightforward = Encoder(exact, EncoderConfig(context=None))
    target = encoder.encode(burst)
    many = build_reference(_repeated(scanned)), _repeated(target)
    reduced, whole = (
        MatchedPair(reference, target, dims, zero_shot_pose.CORRESPONDENCES, "cyclical") for dims in (PoseConfig().dims, None)
    )
    threshold_m = PoseConfig().inlier_ratio * cloud_extent_m(target.cloud_m)
    memory = [Member.of("reference", scanned)]
    return {
        "encode": partial(_encode, encoder, burst),
        "learn": partial(_learn, scanned),
        **{f"decide {score}": partial(_decide, memory, target, score) for score in (BEST, *SCORES)},
        VERIFIED_DECISION: partial(_verify, memory[0], target, reference, network.whitening),
        **{f"solve {name}": partial(_solve, PoseEstimator(PoseConfig.named(name)), reference, target) for name in VARIANTS},
        **{_more(name): partial(_solve, PoseEstimator(PoseConfig.named(name)), *many) for name in GROWING},
        STRAIGHTFORWARD: partial(_encode, straightforward, burst),
        NEAR: partial(_encode, near, burst),
        "complete depth, 640 by 480": partial(_complete, np.random.default_rng(0)),
        PRODUCTS: partial(_without_stages, zero_shot_pose.bare_products, *reduced.descriptors),
        RECIPE: partial(_without_stages, zero_shot_pose.solve, whole, threshold_m, 0),
        BARE: partial(_without_stages, _bare_passes, network, encoder.config, len(burst), device),
    }


def target_rows(rows: Sequence[SpeedRow], reference_mb: float) -> list[TargetRow]:
    """Ratios of the table's totals, with what each should be."""
    ms = {row.operation: row.ms for row in rows if row.stage == "total"}
    alone = next(row.ms for row in rows if row.stage == "alone")
    return [
        TargetRow("encoding, of the straightforward two passes in single precision", ms["encode"] / ms[STRAIGHTFORWARD], "at most 0.40"),
        TargetRow("the bare products of both passes, of the same", ms[BARE] / ms[STRAIGHTFORWARD], "encoding's limit"),
        TargetRow("encoding near the object only, which costs accuracy, of the same", ms[NEAR] / ms[STRAIGHTFORWARD], "at most 0.40"),
        TargetRow("ucd, of the bare products of the same patches", ms["solve ucd"] / ms[PRODUCTS], "at most 3"),
        TargetRow("the recipe of zero-shot-pose, of ucd", ms[RECIPE] / ms["solve ucd"], "at least 20"),
        TargetRow("best, ms", ms["solve best"], "at most 150"),
        *(TargetRow(f"{name}, {MORE} times the views", ms[_more(name)] / ms[f"solve {name}"], "at most 4") for name in GROWING),
        TargetRow("completing depth, ms", alone, "at most 5"),
        TargetRow("a reference on disk, MB", reference_mb, "at most 0.5"),
    ]


def _waterfall(rows: Sequence[SpeedRow]) -> list[tuple[str, float, float]]:
    """Stages of an observation in order, with the straightforward encoder's beside them."""
    ms = {(row.operation, row.stage): row.ms for row in rows}
    found = []
    for operation in OBSERVATION:
        for stage in [stage for each, stage in ms if each == operation and stage != "total"] or ["total"]:
            other = ms.get((STRAIGHTFORWARD, stage)) if operation == OBSERVATION[0] else None
            found.append((f"{operation}, {stage}", ms[operation, stage], other or float("nan")))
    return found


def table_rows(times: Sequence[dict[str, dict[str, float]]], observation: Sequence[str]) -> list[SpeedRow]:
    """Medians over rounds.

    Args:
        times: for each round, milliseconds by stage by operation; `total` is a stage of every operation.
        observation: operations whose totals add up to ratio 1.
    """
    medians = {
        name: {stage: float(np.median([each[name][stage] for each in times])) for stage in stages} for name, stages in times[0].items()
    }
    whole = sum(medians[name]["total"] for name in observation)
    return [SpeedRow(name, stage, ms, ms / whole) for name, stages in medians.items() for stage, ms in stages.items()]


def _more(variant: str) -> str:
    return f"solve {variant}, {MORE} times the views"


def _rounds(operations: dict[str, Operation], rounds: int) -> list[dict[str, dict[str, float]]]:
    times = []
    with bar() as progress:
        for _ in progress.track(range(WARM_UP + rounds), description="timing"):
            times.append({name: _timed(operation) for name, operation in operations.items()})
    return times[WARM_UP:]


def _timed(operation: Operation) -> dict[str, float]:
    started = time.perf_counter()
    stages = operation()
    return {**stages, "total": 1000 * (time.perf_counter() - started)}


def _encode(encoder: Encoder, burst: Burst) -> dict[str, float]:
    return encoder.encode(burst).stage_ms


def _learn(scanned: EncodedBurst) -> dict[str, float]:
    build_reference(scanned)
    return {}


def _decide(memory: Sequence[Member], target: EncodedBurst, score: str) -> dict[str, float]:
    decide(memory, target, DecisionConfig(score))
    return {}


def _verify(member: Member, target: EncodedBurst, reference: Reference, whitening: Whitening | None) -> dict[str, float]:
    """With the poses of as many categories as are ever tried, which are one and the same here."""

    context = Context(whitening, verify=lambda category_id: verify(reference, target, whitening)[1])
    decide([replace(member, category_id=str(copy)) for copy in range(VERIFIED)], target, context=context)
    return {}


def _solve(estimator: PoseEstimator, reference: Reference, target: EncodedBurst) -> dict[str, float]:
    return estimator.estimate(reference, target).stage_ms


def _complete(rng: np.random.Generator) -> dict[str, float]:
    depth = rng.uniform(0.5, 1.5, (480, 640)).astype(np.float32)
    depth[rng.random(depth.shape) < 0.1] = 0
    started = time.perf_counter()
    complete(depth)
    return {"alone": 1000 * (time.perf_counter() - started)}


def _bare_passes(network: Backbone, config: EncoderConfig, views: int, device: str) -> None:
    for grid in (config.first_grid, config.grid):
        transformer_products.bare_products(grid, network.dim, views, device, fast_dtype(device))
    if device != "cpu":
        torch.cuda.synchronize()


def _without_stages(function: Callable[..., object], *arguments: object) -> dict[str, float]:
    function(*arguments)
    return {}


def _repeated(encoded: EncodedBurst) -> EncodedBurst:
    """MORE times the views: the same again, which takes as long as others would."""
    return encoded.select(list(range(len(encoded.views))) * MORE)


def _megabytes(reference: Reference) -> float:
    file = BytesIO()
    np.savez(file, allow_pickle=False, **reference.as_arrays())
    return len(file.getvalue()) / 1e6
