"""What each part of the variant `best` adds, and where it stops: the same pairs with one part changed at a time.

The last row picks, among the hypotheses that `best` refined, the one nearest the truth: what is lost above it is lost by ranking.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.pair_jobs import PairJob, pair_jobs
from benchmarks.pairs import UNPOSED, ViewCounts
from benchmarks.parallel import map_jobs
from benchmarks.tables import report
from core.backbones import load_backbone
from core.best_pose import BestConfig
from core.encode import Encoder
from core.hypotheses import HypothesesConfig
from core.pose import VARIANTS, PoseConfig, PoseEstimator

_BEST = BestConfig()
_GUESSES = HypothesesConfig()
ORACLE = "the hypothesis nearest the truth"
CHANGES = {
    "best": _BEST,
    "refined by principal components": replace(_BEST, steady=False),
    "no agreement of view pairs": replace(_BEST, view_weight=0.0),
    "one hypothesis refined": replace(_BEST, refined=1),
    "no hypotheses of single pairs": replace(_BEST, hypotheses=replace(_GUESSES, single_pairs=0, aligned_pairs=1)),
    "no hypotheses of clusters": replace(_BEST, hypotheses=replace(_GUESSES, clusters=0)),
    "no polish": replace(_BEST, polish=None),
    ORACLE: replace(_BEST, alternatives=_BEST.refined, alternative_deg=_BEST.distinct_deg),
}
"""Of the last, the best alternative counts too."""


@dataclass(frozen=True)
class AblationRow:
    """Means over categories, percent and degrees."""

    change: str
    views: str
    pairs: int
    acc30: float
    acc15: float
    acc7_5: float
    median_deg: float
    """Median over all pairs."""


def run(data: Path, views: Sequence[str], limit: int, json: Path | None, seed: int, backbone: str) -> list[AblationRow]:
    """Every change of CHANGES under every count of views; prints and returns the table.

    Raises InvalidInput for bad view counts, or data without pairs, ground truth or enough views.
    """
    network = load_backbone(backbone)
    jobs = pair_jobs(data, views, limit, seed, Encoder(network))
    errors = map_jobs(solve, jobs, lambda job: 1, "solving")
    rows = [
        _row(change, count, [(job.pair[0].category, error[change]) for job, error in zip(jobs, errors, strict=True) if job.views == count])
        for count in dict.fromkeys(job.views for job in jobs)
        for change in CHANGES
    ]
    meta = {"benchmark": "ablation", "data": data, "limit": limit, "seed": seed, "fingerprint": network.fingerprint}
    report(f"Ablation of best, {data}", rows, meta, json)
    return rows


def solve(job: PairJob) -> dict[str, float]:
    """The rotation error of one pair under every change, degrees; 180 for a refused pose."""
    reference, target = job.reference(), job.target()
    errors = {}
    for change, config in CHANGES.items():
        try:
            found = job.errors_deg(PoseEstimator(_config(config)).estimate(reference, target, seed=job.seed))
        except UNPOSED:
            found = [180.0]
        errors[change] = min(found) if change == ORACLE else found[0]
    return errors


def _config(best: BestConfig) -> PoseConfig:
    return replace(VARIANTS["best"], best=best)


def _row(change: str, views: ViewCounts, errors: Sequence[tuple[str, float]]) -> AblationRow:
    categories = sorted({category for category, _ in errors})
    of_category = [np.array([error for each, error in errors if each == category]) for category in categories]
    acc30, acc15, acc7_5 = (100 * float(np.mean([(each <= limit).mean() for each in of_category])) for limit in (30, 15, 7.5))
    return AblationRow(change, views.text, len(errors), acc30, acc15, acc7_5, float(np.median([error for _, error in errors])))
