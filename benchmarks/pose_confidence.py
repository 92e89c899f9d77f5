"""Fits the confidence of a pose, and shows whether it is kept: `python -m benchmarks.pose_confidence --fit DIR --data DIR --out FOLDER`.

The model is fitted to the recordings below `--fit` and written where it ships from; the reliability below `--data`, which the fit never
saw, goes to `--out` as a plot and JSON. Without `--fit` the shipped model is shown.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from matplotlib.figure import Figure
from numpy.typing import NDArray

from benchmarks.pair_jobs import PairJob, pair_jobs
from benchmarks.pairs import UNPOSED
from benchmarks.parallel import map_jobs
from benchmarks.pictures import save
from benchmarks.tables import print_table, write_json
from core.backbones import load_backbone
from core.confidence import SHIPPED, Confidence, evidence
from core.encode import Encoder
from core.pose import VARIANTS, PoseEstimator

RIGHT_DEG = 30.0
"""Rotation error up to which a pose counts as right."""
BINS = 5
"""Of the plot, with as many poses each."""


@dataclass(frozen=True, eq=False)
class Judged:
    """The hypotheses of one estimate, best first."""

    evidence: NDArray[np.floating]
    """Shape (T, X)."""
    right: NDArray[np.bool_]
    """Shape (T,)."""


def main(
    data: Annotated[str, typer.Option(help="Recordings that the reliability is measured on.")],
    out: Annotated[Path, typer.Option(help="Folder for reliability.png and .json.")],
    fit: Annotated[str | None, typer.Option(help="Recordings that the model is fitted to.")] = None,
    views: Annotated[list[str], typer.Option(help="As in onelook bench pose; may be repeated.")] = ["10", "5", "10+3", "10+1"],  # noqa: B006
    limit: Annotated[int, typer.Option(help="Pairs a category at most.")] = 12,
    seed: Annotated[int, typer.Option()] = 0,
) -> None:
    """Fits, if asked to, and measures."""
    backbone = load_backbone(report=typer.echo)
    encoder = Encoder(backbone)
    if fit is not None:
        samples = _judge(fit, encoder, views, limit, seed)
        hypotheses = np.concatenate([each.evidence for each in samples]), np.concatenate([each.right for each in samples])
        SHIPPED.write_text(json.dumps(asdict(Confidence.fit(backbone.fingerprint, *hypotheses)), indent=1) + "\n")
        typer.echo(f"wrote {SHIPPED.name} from {len(samples)} poses")
        Confidence.shipped.cache_clear()
    judged = _judge(data, encoder, views, limit, seed)
    confidence = np.array([Confidence.shipped().probability(each.evidence)[0] for each in judged])
    right = np.array([each.right[0] for each in judged])
    rows = [asdict(row) for row in reliability(confidence, right)]
    out.mkdir(parents=True, exist_ok=True)
    meta = {
        "data": data,
        "views": views,
        "limit": limit,
        "seed": seed,
        "poses": len(judged),
        "brier": float(np.mean((confidence - right) ** 2)),
    }
    write_json(out / "reliability.json", meta, rows)
    _plot(out / "reliability.png", rows, f"{len(judged)} poses, Brier score {meta['brier']:.3f}")
    print_table("Confidence", rows, list(rows[0]))


@dataclass(frozen=True)
class Bin:
    """Poses of about one confidence; percent."""

    lowest: float
    highest: float
    confidence: float
    """Mean."""
    right: float
    """How many were."""
    poses: int


def reliability(confidence: NDArray[np.floating], right: NDArray[np.bool_]) -> list[Bin]:
    """Poses sorted by confidence, in BINS bins of as many each, given both, shape (T,)."""
    parts = [part for part in np.array_split(np.argsort(confidence, kind="stable"), BINS) if len(part)]
    return [_bin(100 * confidence[part], right[part]) for part in parts]


def _bin(confidence: NDArray[np.floating], right: NDArray[np.bool_]) -> Bin:
    return Bin(float(confidence.min()), float(confidence.max()), float(confidence.mean()), 100 * float(right.mean()), len(right))


def judge(job: PairJob) -> Judged | None:
    """The hypotheses of one pair against the truth; None where no pose was found."""
    reference, target = job.reference(), job.target()
    try:
        estimate = PoseEstimator(VARIANTS["best"]).estimate(reference, target, seed=job.seed)
    except UNPOSED:
        return None
    assert estimate.score is not None, "of the variant best"
    scores = np.array([estimate.score, *(each.score for each in estimate.alternatives)])
    return Judged(evidence(scores, len(target.views)), np.array(job.errors_deg(estimate)) <= RIGHT_DEG)


def _judge(data: str, encoder: Encoder, views: Sequence[str], limit: int, seed: int) -> list[Judged]:
    judged = map_jobs(judge, pair_jobs(data, views, limit, seed, encoder), lambda job: 1, "solving")
    return [each for each in judged if each is not None]


def _plot(file: Path, rows: Sequence[dict[str, float]], title: str) -> None:
    figure = Figure((5, 5), layout="constrained")
    axes = figure.subplots()
    axes.plot([0, 100], [0, 100], "k--", linewidth=1, label="as said")
    axes.plot([row["confidence"] for row in rows], [row["right"] for row in rows], "o-", label="as measured")
    for row in rows:
        axes.annotate(f"{row['poses']}", (row["confidence"], row["right"]), textcoords="offset points", xytext=(6, -12), fontsize=8)
    axes.set(xlim=(0, 101), ylim=(0, 101), xlabel="confidence, %", ylabel="rotation within 30°, %", title=title)
    axes.legend(loc="upper left")
    save(figure, file)


if __name__ == "__main__":
    typer.run(main)
