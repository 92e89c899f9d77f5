"""Whether one more look, from where an uncertain decision says, settles it: in the rendered world.

Half of the categories are in a memory, by one object each. It came to them as a robot does: one after the other was met in a few views of
one side, which calibrates the memory, and then scanned. Other objects of all categories are met in as many views. Where
the answer is uncertain, one view more is taken: from the first viewpoint that the decision offers, and in comparison from random ones of
the same hemisphere. It settles the case rightly where the answer becomes the object's category, or novel for an object of none. Then the
other half of the categories is the memory.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cache
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.parallel import map_jobs
from benchmarks.tables import Row, print_table, write_json
from clients.simulator.raycast.categories import RECIPES
from clients.simulator.raycast.export import around
from clients.simulator.raycast.world import RaycastWorld
from core.backbones import load_backbone
from core.camera_poses import angles_about_deg
from core.encode import EncodedBurst, Encoder
from core.errors import InvalidInput, NoObject, NoPose
from core.next_view import OFFERED, Candidate, next_viewpoints
from core.novelty import Context, Decision, DecisionConfig, Member, decide
from core.packing import burst_as_arrays, burst_from_arrays
from core.reference import Reference, build_reference
from core.scan import ScanOptions, request_scan
from core.verification import verify
from core.view_consistency import consistent_only
from core.views import Burst, FloatArray, View

SCANNED = 10
"""Views of an object that is learnt."""
AROUND = 12
"""Viewpoints all around of which the first views are neighbours."""
RANDOM = 3
"""Random viewpoints tried in a case, each for itself."""
COLUMNS = ("next_view", "cases", "views_tried", "settled_rightly", "settled_wrongly", "still_uncertain")


@dataclass(frozen=True)
class Thing:
    """An object of the rendered world and the room it stands in."""

    category: str
    number: int
    seed: int

    def enter(self) -> RaycastWorld:
        """The world with it on the table."""
        world = RaycastWorld(int(np.random.default_rng([self.seed, self.number, sum(map(ord, self.category))]).integers(1 << 30)))
        world.show([RECIPES[self.category].make(self.category, self.number)])
        return world


@dataclass(frozen=True)
class Job:
    """An object to be met, and the memory that meets it."""

    thing: Thing
    memory: tuple[tuple[str, Path], ...]
    """Category and encoded scan of each member."""
    looks: int
    """Views of one side with which an answer is first sought."""
    rate: float
    backbone: str
    past: tuple[Decision, ...] = ()
    """Of the members, as each was met."""


@dataclass(frozen=True)
class Case:
    """What became of one object; each answer is `right`, `wrong` or `uncertain`."""

    category: str
    held: bool
    """Whether its category is in the memory."""
    first: str
    """After the first views."""
    offered: str | None = None
    """After one from the viewpoint that was offered; None where the first answer was clear."""
    at_random: tuple[str, ...] = ()


@dataclass(frozen=True)
class Scan:
    """An object to be learnt."""

    thing: Thing
    file: Path
    backbone: str


def run(
    json: Path | None,
    categories: Sequence[str],
    *,
    instances: int,
    looks: int,
    rate: float,
    seed: int,
    backbone: str,
) -> list[Row]:
    """Meets `instances` objects of each category, all categories of the world where none is named, and prints a table.

    Raises InvalidInput for an unknown category, or fewer than two.
    """
    names = sorted(set(categories or RECIPES))
    unknown = [name for name in names if name not in RECIPES]
    if unknown or len(names) < 2:
        raise InvalidInput("category", f"expected two or more of {', '.join(RECIPES)}, found {', '.join(unknown or names)}")
    load_backbone(backbone)  # fetched once, before the workers ask for it
    with TemporaryDirectory() as folder:
        scans = [Scan(Thing(name, instances, seed), Path(folder) / f"{name}.npz", backbone) for name in names]
        map_jobs(learn, scans, lambda scan: 1, "learning")
        shuffled = np.random.default_rng(seed).permutation(len(names))
        memories = [tuple((scans[index].thing.category, scans[index].file) for index in shuffled[side::2]) for side in (0, 1)]
        new = [
            [Job(Thing(name, instances, seed), memory[:held], looks, rate, backbone) for held, (name, _) in enumerate(memory)]
            for memory in memories
        ]
        found = iter(map_jobs(first_met, [job for jobs in new for job in jobs], lambda job: 1, "meeting what is new"))
        pasts = [tuple(decision for decision in islice(found, len(jobs)) if decision) for jobs in new]
        things = [Thing(name, number, seed) for name in names for number in range(instances)]
        jobs = [Job(thing, memory, looks, rate, backbone, past) for memory, past in zip(memories, pasts) for thing in things]
        cases = map_jobs(meet, jobs, lambda job: 1, "meeting")
    rows = summary(cases)
    if json is not None:
        meta = {"benchmark": "next_view", "seed": seed, "instances": instances, "rate": rate, "looks": looks, "backbone": backbone}
        write_json(json, meta, rows + [asdict(case) for case in cases])
    print_table(f"One more view, {len(cases)} objects met, first views: {looks}", rows, COLUMNS)
    return rows


def summary(cases: Sequence[Case]) -> list[Row]:
    """A row for the first answers and one for each way to choose the next view; shares in percent."""
    uncertain = [case for case in cases if case.offered is not None]
    offered = [case.offered for case in uncertain]
    at_random = [answer for case in uncertain for answer in case.at_random]
    return [
        _row("none", len(cases), 0, [case.first for case in cases]),
        _row("offered", len(uncertain), len(offered), offered),
        _row("random", len(uncertain), len(at_random), at_random),
    ]


def _row(name: str, cases: int, tried: int, answers: Sequence[str | None]) -> Row:
    right, wrong, uncertain = (100 * answers.count(answer) / max(len(answers), 1) for answer in ("right", "wrong", "uncertain"))
    values = (name, cases, tried, right, wrong, uncertain)
    return dict(zip(COLUMNS, values))


def learn(scan: Scan) -> None:
    """Looks at an object from all sides and writes what it encodes to."""
    world = scan.thing.enter()
    views = [world.capture(pose) for pose in around(world.objects[0], SCANNED, np.random.default_rng([scan.thing.seed, 1]))]
    np.savez(scan.file, allow_pickle=False, **burst_as_arrays(_encode(views, scan.backbone)))


def first_met(job: Job) -> Decision | None:
    """What the memory takes an object of a new category for, and is told that it is new; None where no object was seen."""
    _, views = first_views(job)
    try:
        return Memory(job).decide(_encode(views, job.backbone)).corrected(job.thing.category)
    except NoObject:
        return None


def meet(job: Job) -> Case:
    """See `Case`."""
    world, views = first_views(job)
    held = any(category == job.thing.category for category, _ in job.memory)
    memory = Memory(job)
    try:
        encoded = _encode(views, job.backbone)
    except NoObject:  # nothing was seen, so nothing was answered
        return Case(job.thing.category, held, "wrong")
    decision = memory.decide(encoded)
    first = verdict(decision, job.thing.category, held)
    if decision.outcome != "uncertain":
        return Case(job.thing.category, held, first)
    offered = memory.viewpoints(encoded, decision)
    among = request_scan(encoded, ScanOptions(OFFERED)).world_from_camera
    drawn = np.random.default_rng([job.thing.seed, job.thing.number]).permutation(len(among))[:RANDOM]

    def after(pose: FloatArray) -> str:
        again = memory.decide(_encode([*views, world.capture(pose)], job.backbone), looks=1)
        return verdict(again, job.thing.category, held)

    return Case(job.thing.category, held, first, after(offered[0]), tuple(after(among[index]) for index in drawn))


def first_views(job: Job) -> tuple[RaycastWorld, list[View]]:
    """The world with the object in it, and its views from neighbouring poses of those that a robot looks from before it is asked."""
    world = job.thing.enter()
    poses = np.stack(world.viewpoints(AROUND, job.thing.seed))
    nearest = np.argsort(angles_about_deg(poses[:1, :3, 3], poses[:, :3, 3], world.center_m)[0])
    return world, [world.capture(pose) for pose in poses[nearest[: job.looks]]]


def verdict(decision: Decision, category: str, held: bool) -> str:
    """Whether an answer is `right`, `wrong` or `uncertain`."""
    if decision.outcome == "uncertain":
        return "uncertain"
    right = decision.similarities[0][0] == category if decision.outcome == "known" else not held
    return "right" if right else "wrong"


class Memory:
    """Decides as the service does once it has met and learnt its members, and nothing else."""

    def __init__(self, job: Job) -> None:
        self._encoder = _encoder(job.backbone)
        self._rate, self._past = job.rate, job.past
        self._scans = dict(job.memory)
        self._members = [_member(category, file) for category, file in job.memory]
        self._laid: dict[str, Candidate] = {}
        """Poses of the decision just made."""

    def decide(self, encoded: EncodedBurst, looks: int = 0) -> Decision:
        """With poses. `looks`: views taken since the answer was uncertain."""
        whitening = self._encoder.backbone.whitening
        self._laid = {}

        def explain(category: str) -> float:
            reference = _reference(self._scans[category])
            try:
                estimate, found = verify(reference, encoded, whitening)
            except NoPose:
                return 0.0
            self._laid[category] = Candidate(reference, estimate.target_from_reference)
            return found

        config = DecisionConfig(false_known_rate=self._rate, looks=looks)
        return decide(self._members, encoded, config, Context(whitening, self._past, explain))

    def viewpoints(self, encoded: EncodedBurst, decision: Decision) -> FloatArray:
        """Those offered with the decision just made, shape (n, 4, 4)."""
        laid = [self._laid[category] for category, _ in decision.similarities if category in self._laid]
        return next_viewpoints(encoded, laid, self._encoder.backbone.whitening)


@cache
def _encoder(backbone: str) -> Encoder:
    return Encoder(load_backbone(backbone))


def _encode(views: Sequence[View], backbone: str) -> EncodedBurst:
    return consistent_only(_encoder(backbone).encode(Burst(tuple(views))))


@cache
def _scan(file: Path) -> EncodedBurst:
    with np.load(file, allow_pickle=False) as arrays:
        return burst_from_arrays(arrays)


@cache
def _reference(file: Path) -> Reference:
    return build_reference(_scan(file))


@cache
def _member(category: str, file: Path) -> Member:
    return Member.of(category, _scan(file))
