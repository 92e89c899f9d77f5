"""How much worse sensors and places may get: pose accuracy and decisions against the strength of each degradation.

Only the target burst, the robot's, is degraded; what the memory holds is clean. One encoding of a degraded burst serves its poses, against
other objects of its kind, and its decision, against all other objects. Encodings and poses are cached, so that an interrupted run goes on
where it stopped. Silhouettes only place occluders and clutter; the product finds the object by itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from zlib import crc32

import numpy as np

from benchmarks.clean_memory import UNSEEN, CleanMemory, Decisions, Known
from benchmarks.degradations.catalogue import CLUTTER, Degradation, catalogue
from benchmarks.degraded import Remembering, encode_degraded, masked_views
from benchmarks.encoded import encode_all
from benchmarks.pair_scores import auroc
from benchmarks.pairs import ViewCounts, choose_views, require_true_poses, require_views
from benchmarks.parallel import map_jobs
from benchmarks.robustness_plot import plot
from benchmarks.tables import Row, print_table, write_json
from clients.datasets import folders
from clients.datasets.sources import find_sequences
from clients.pose_error import NO_POSE, PoseError, accuracy, median, pose_error
from core.backbones import load_backbone
from core.backbones.base import Backbone
from core.backbones.whitening import Whitening
from core.encode import Encoder
from core.errors import InvalidInput, NoObject
from core.sim3 import Sim3
from core.views import View

CLEAN = "none"
"""The name of no degradation."""
REFERENCES = 3
"""Other objects of its kind that a degraded one is posed against, at most."""
FALL = 10.0
"""Points that a figure may lose before it counts as broken."""
FIGURES = ("acc30", "acc15", "auroc")
"""Those that may break: of poses and of decisions."""
COLUMNS = ("degradation", "strength", "acc30", "acc15", "median_deg", "auroc", "nearest", "right", "uncertain", "false_known")
BREAKS = ("degradation", "unit", *(f"{figure}_breaks_at" for figure in FIGURES))


@dataclass(frozen=True)
class Recordings:
    """All clean bursts."""

    sequences: tuple[folders.Sequence, ...]
    files: tuple[Path, ...]
    """Their encodings."""
    views: ViewCounts
    seed: int
    backbone: str
    poses: bool
    """Whether poses verify decisions."""

    def chosen(self, index: int, role: str) -> tuple[int, ...]:
        """The views that stand for a sequence as `reference` or `target`."""
        sequence, count = self.sequences[index], self.views.target if role == "target" else self.views.reference
        return tuple(choose_views(sequence.name, role, len(sequence.images), count, self.seed))

    def known(self, index: int) -> Known:
        """A sequence as the memory holds it."""
        return Known(self.sequences[index].category, self.files[index], self.chosen(index, "reference"))

    def memory_without(self, index: int, whitening: Whitening | None) -> CleanMemory:
        """All sequences but one."""
        others = tuple(self.known(other) for other in range(len(self.sequences)) if other != index)
        return CleanMemory(others, whitening, self.seed, self.poses)

    def things(self, index: int) -> list[int]:
        """Sequences of other categories than that of a sequence."""
        return [other for other, each in enumerate(self.sequences) if each.category != self.sequences[index].category]


@dataclass(frozen=True)
class Job:
    """One target under some degradations."""

    recordings: Recordings
    target: int
    references: tuple[int, ...]
    strengths: dict[str, tuple[float, ...]]
    """Of each degradation."""


@dataclass(frozen=True)
class Outcome:
    """What became of one degraded burst."""

    degradation: str
    strength: float
    errors: tuple[PoseError, ...]
    """Of its pose against each reference."""
    decisions: Decisions


def run(
    data: Path,
    json: Path | None,
    picture: Path | None,
    *,
    views: str,
    limit: int | None,
    degradations: Sequence[str],
    categories: Sequence[str],
    strongest: int | None,
    seed: int,
    backbone: str,
    poses: bool,
) -> list[Row]:
    """Degrades up to `limit` objects a category of `data`; prints and returns a row for each strength, and one for each degradation.

    Args:
        picture: folder for the curves.
        degradations: names of those that are tried; all where there are none.
        categories: of the targets, likewise; what the memory holds is of all.
        strongest: so many strengths of each degradation are tried, the last ones; all where None.
        poses: whether poses verify decisions, as in the service.

    Raises InvalidInput for an unknown degradation, or data without two objects of a kind, ground truth, depth or enough views.
    """
    listed = _listed(degradations, strongest)
    network = load_backbone(backbone)
    sequences = tuple(find_sequences(data))
    recordings = Recordings(sequences, tuple(encode_all(sequences, Encoder(network))), ViewCounts.parse(views), seed, backbone, poses)
    jobs = [job for job in plan(recordings, limit, listed) if not categories or sequences[job.target].category in categories]
    if not jobs:
        raise InvalidInput("category", f"no two objects below {data} are of {', '.join(categories)}")
    outcomes = [outcome for outcomes in map_jobs(work, jobs, lambda job: len(job.strengths), "degrading") for outcome in outcomes]
    rows = table_rows(listed, outcomes)
    if json is not None:
        meta = {
            "benchmark": "robustness",
            "data": data,
            "seed": seed,
            "views": views,
            "limit": limit,
            "categories": list(categories),
            "strongest": strongest,
            "poses": poses,
            "backbone": network.name,
            "fingerprint": network.fingerprint,
        }
        write_json(json, meta, rows)
    if picture is not None:
        plot(picture, rows)
    print_table(f"Robustness, {data}", [row for row in rows if "acc30" in row], COLUMNS)
    print_table(f"Where {FALL:.0f} points are lost", [row for row in rows if "acc30" not in row], BREAKS)
    return rows


def _listed(names: Sequence[str], strongest: int | None) -> list[Degradation]:
    """Those of the catalogue that are named, all where none is. Raises InvalidInput for a name that it does not have."""
    known = {each.name: each for each in catalogue([])}
    unknown = set(names) - set(known)
    if unknown:
        raise InvalidInput("degradation", f"{', '.join(sorted(unknown))} is none of {', '.join(known)}")
    listed = [each for name, each in known.items() if not names or name in names]
    return listed if strongest is None else [replace(each, strengths=each.strengths[-strongest:]) for each in listed]


def plan(recordings: Recordings, limit: int | None, degradations: Sequence[Degradation]) -> list[Job]:
    """For each target a job for all that leaves the picture as it is, and one for each other degradation.

    One target of each category comes first, one degradation after the other: a smaller limit takes a prefix of a larger one's.
    """
    if any(each.name == CLUTTER for each in degradations) and len({sequence.category for sequence in recordings.sequences}) < 2:
        raise InvalidInput("degradation", f"{CLUTTER} sets objects of another category around, and there is one alone; name others")
    geometric = {each.name: each.strengths for each in degradations if not each.repaints}
    groups: list[dict[str, tuple[float, ...]]] = [{CLEAN: (0.0,), **geometric}]
    groups += [{each.name: each.strengths} for each in degradations if each.repaints]
    ranked: list[tuple[int, int, tuple[int, ...]]] = []
    for category in sorted({sequence.category for sequence in recordings.sequences}):
        members = [index for index, sequence in enumerate(recordings.sequences) if sequence.category == category]
        order = np.random.default_rng([recordings.seed, crc32(category.encode())]).permutation(members).tolist()
        for rank, target in enumerate(order[:limit] if len(order) > 1 else []):
            others = (order[rank + 1 :] + order[:rank])[:REFERENCES]
            ranked.append((rank, target, tuple(others)))
    tried = [recordings.sequences[index] for _, target, others in ranked for index in (target, *others)]
    require_true_poses(tried)
    require_views(tried, [recordings.views])
    jobs = [(rank, Job(recordings, target, others, group)) for group in groups for rank, target, others in ranked]
    return [job for _, job in sorted(jobs, key=lambda entry: entry[0])]


def work(job: Job) -> list[Outcome]:
    """Degrades, encodes, poses and decides."""
    recordings = job.recordings
    encoder = Encoder(Remembering(backbone_named(recordings.backbone)))
    name = recordings.sequences[job.target].name
    views = _masked(recordings, job.target, recordings.chosen(job.target, "target"))
    things = [_masked(recordings, other, [0])[0] for other in recordings.things(job.target)] if CLUTTER in job.strengths else []
    worse: list[tuple[str, float, list[View]]] = [(CLEAN, 0.0, views)] if CLEAN in job.strengths else []
    for each in catalogue(things):
        tried = job.strengths.get(each.name, ())
        worse += [(each.name, strength, each.degrade(views, strength, name, recordings.seed)) for strength in tried]
    return [Outcome(kind, strength, *judge(job, degraded, encoder)) for kind, strength, degraded in worse]


def judge(job: Job, views: Sequence[View], encoder: Encoder) -> tuple[tuple[PoseError, ...], Decisions]:
    """Errors of the pose against each of the job's references, and the decision; where no object is found there is neither."""
    recordings = job.recordings
    try:
        file = encode_degraded(views, encoder)
    except NoObject:
        return (NO_POSE,) * len(job.references), UNSEEN
    sequence = recordings.sequences[job.target]
    memory = recordings.memory_without(job.target, encoder.backbone.whitening)
    errors = []
    for other in job.references:
        found = memory.lay(recordings.known(other), file).target_from_reference
        errors.append(NO_POSE if found is None else _error(found, recordings.sequences[other], sequence))
    return tuple(errors), memory.decide(file, sequence.category)


def table_rows(degradations: Sequence[Degradation], outcomes: Sequence[Outcome]) -> list[Row]:
    """A row for what is clean and for each strength, then one for each degradation: where it breaks."""
    by_setting: dict[tuple[str, float], list[Outcome]] = {}
    for outcome in outcomes:
        by_setting.setdefault((outcome.degradation, outcome.strength), []).append(outcome)
    clean = figures(by_setting[CLEAN, 0.0])
    rows: list[Row] = [{"degradation": CLEAN, "strength": 0.0, **clean}]
    breaks: list[Row] = []
    for each in degradations:
        curve = [figures(by_setting[each.name, strength]) for strength in each.strengths]
        rows += [{"degradation": each.name, "strength": strength, **row} for strength, row in zip(each.strengths, curve)]
        places = [each.none, *each.strengths]
        found = {f"{figure}_breaks_at": breaks_at(places, [row[figure] for row in (clean, *curve)]) for figure in FIGURES}
        breaks.append({"degradation": each.name, "unit": each.unit, "none": each.none, **found})
    return rows + breaks


def figures(outcomes: Sequence[Outcome]) -> dict[str, float]:
    """Of all bursts at one strength, percent and degrees; AUROC is of evidence for the own category against that for the best wrong one."""
    errors = [error for outcome in outcomes for error in outcome.errors]
    decisions = [outcome.decisions for outcome in outcomes]
    shares = {
        name: 100 * float(np.mean([getattr(each, name) for each in decisions]))
        for name in ("right", "uncertain", "novel", "nearest", "false_known")
    }
    return {
        "bursts": len(outcomes),
        "pairs": len(errors),
        "acc30": accuracy(errors, 30),
        "acc15": accuracy(errors, 15),
        "median_deg": median(errors, "rotation_deg"),
        **shares,
        "auroc": 100 * auroc(np.array([each.own for each in decisions]), np.array([each.rival for each in decisions])),
    }


def breaks_at(strengths: Sequence[float], values: Sequence[float]) -> float | None:
    """The strength from which on a figure stays FALL below its first value, on straight lines between what was measured, if any."""
    limit = values[0] - FALL
    last = max(index for index, value in enumerate(values) if value > limit)
    if last == len(values) - 1:
        return None
    share = (values[last] - limit) / (values[last] - values[last + 1])
    return float(strengths[last] + share * (strengths[last + 1] - strengths[last]))


@cache
def backbone_named(name: str) -> Backbone:
    """Loaded once a process."""
    return load_backbone(name)


def _error(estimate: Sim3, reference: folders.Sequence, target: folders.Sequence) -> PoseError:
    assert reference.world_from_model, "plan requires ground truth"
    assert target.world_from_model, "plan requires ground truth"
    return pose_error(estimate, reference.world_from_model, target.world_from_model, target.symmetries)


def _masked(recordings: Recordings, index: int, indices: Sequence[int]) -> list[View]:
    return masked_views(recordings.sequences[index], recordings.files[index], indices)
