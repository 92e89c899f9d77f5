"""An episode: a robot with an empty memory meets objects one by one (paper, "Continual category learning").

Everything that is scored comes from the service's answers; the ground truth stays with the simulator.
"""

from __future__ import annotations

import random
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from clients.answers import Category
from clients.datasets import folders
from clients.errors import ClientError, ServiceProblem
from clients.pose_error import NO_POSE, PoseError, accuracy, median, pose_error
from clients.robot import Observation, RobotClient, Scan
from clients.simulator.replay import ReplayWorld
from core.views import Burst


class Verdict(Enum):
    """What a decision was worth, given the true categories."""

    NEW = "new category"
    """Novel, and rightly so."""
    RECOGNISED = "recognised"
    """Known, as the category that an object of the same kind founded."""
    FALSE_NOVEL = "false novel"
    """Novel, though its category is in the memory."""
    FALSE_KNOWN = "false known"
    """Known as a category that another kind of object founded."""
    UNDECIDED = "undecided"

    @property
    def right(self) -> bool:
        """Whether the memory got it right."""
        return self in {Verdict.NEW, Verdict.RECOGNISED}


@dataclass(frozen=True, eq=False)
class Encounter:
    """One object met, what the service answered, and what that was worth."""

    number: int
    """From 1, in the order met."""
    sequence: folders.Sequence
    burst: Burst
    observation: Observation
    in_memory: bool
    """Whether an object of its category had founded one before."""
    verdict: Verdict
    kind: str | None
    """True category of the object that founded the category decided for; None where there is none."""
    error: PoseError | None
    """Of the pose of a rightly recognised object."""
    learnt: Category | None
    """The category that the scan of a novel object made."""
    offsets_deg: tuple[float, ...]
    """How far off the views brought to the scan were from those asked for."""
    failure: str | None
    """Why there is no pose or no category where there should be one."""
    observe_ms: float
    """From sending the burst to having the answer."""
    scan_ms: float | None


class Episode:
    """Meets `sequences` in order; remembers which true category founded each category of the service's."""

    def __init__(self, robot: RobotClient, sequences: Sequence[folders.Sequence], views: int, seed: int) -> None:
        if robot.categories():
            remedy = "start one with `onelook serve --data-dir NEW_FOLDER`"
            raise ClientError(f"the service's memory is not empty, so decisions could not be scored; {remedy}")
        self._robot = robot
        self._views = views
        self._order = random.Random(seed)
        self.sequences = list(sequences)
        self._order.shuffle(self.sequences)
        self._founders: dict[str, folders.Sequence] = {}

    def __iter__(self) -> Iterator[Encounter]:
        return (self._meet(number, sequence) for number, sequence in enumerate(self.sequences, start=1))

    def _meet(self, number: int, sequence: folders.Sequence) -> Encounter:
        world = ReplayWorld(sequence)
        burst = world.glance(self._views, first=self._order.randrange(1 << 16))
        started = time.perf_counter()
        seen = self._robot.observe(burst)
        observe_ms = (time.perf_counter() - started) * 1e3
        founder = self._founders.get(seen.category_id or "")
        in_memory = any(each.category == sequence.category for each in self._founders.values())
        verdict = judge(seen, sequence.category, founder, in_memory)
        learnt, scan_ms, failure = None, None, seen.pose_error or seen.scan_error
        if seen.scan is not None:
            started = time.perf_counter()
            learnt, failure = _carry_out(seen.scan, world)
            scan_ms = (time.perf_counter() - started) * 1e3
        if learnt is not None:
            self._founders[learnt.id] = sequence
        return Encounter(
            number=number,
            sequence=sequence,
            burst=burst,
            observation=seen,
            in_memory=in_memory,
            verdict=verdict,
            kind=founder.category if founder else None,
            error=_error(seen, founder, sequence) if verdict is Verdict.RECOGNISED else None,
            learnt=learnt,
            offsets_deg=tuple(world.offsets_deg),
            failure=failure,
            observe_ms=observe_ms,
            scan_ms=scan_ms,
        )


def judge(seen: Observation, category: str, founder: folders.Sequence | None, in_memory: bool) -> Verdict:
    """What a decision was worth.

    Args:
        category: the object's true category.
        founder: the object that founded the category decided for.
        in_memory: whether an object of the true category had founded one before.
    """
    if seen.outcome == "novel":
        return Verdict.FALSE_NOVEL if in_memory else Verdict.NEW
    if seen.outcome == "uncertain":
        return Verdict.UNDECIDED
    return Verdict.RECOGNISED if founder is not None and founder.category == category else Verdict.FALSE_KNOWN


def _carry_out(scan: Scan, world: ReplayWorld) -> tuple[Category | None, str | None]:
    """The category made, or why none was."""
    try:
        for viewpoint in scan:
            scan.add(world.capture(viewpoint))
        return scan.complete(), None
    except ServiceProblem as problem:
        return None, str(problem)


def _error(seen: Observation, founder: folders.Sequence | None, sequence: folders.Sequence) -> PoseError | None:
    if seen.pose is None or founder is None or founder.world_from_model is None or sequence.world_from_model is None:
        return None
    return pose_error(seen.pose.target_from_reference, founder.world_from_model, sequence.world_from_model, sequence.symmetries)


@dataclass(frozen=True)
class Summary:
    """An episode in figures."""

    objects: int
    kinds: int
    """True categories met."""
    categories: int
    """Categories in the memory at the end."""
    met_again: int
    """Objects whose category was in the memory."""
    correct_known: int
    false_novel: int
    false_known: int
    undecided: int
    acc30: float | None
    """Percentage of rightly recognised objects with ground truth whose rotation is at most 30° off; one without a pose counts as wrong."""
    median_deg: float | None
    """Median rotation error of the poses of rightly recognised objects."""
    observe_ms: float
    """Median time to an answer."""
    scan_ms: float | None
    """Median time from a scan's first view to its category."""
    total_s: float


ACC_DEG = 30.0


def summarise(encounters: Sequence[Encounter], total_s: float) -> Summary:
    """The figures of an episode that met at least one object."""
    count = {verdict: sum(each.verdict is verdict for each in encounters) for verdict in Verdict}
    errors = [each.error for each in encounters if each.error is not None]
    recognised = [each for each in encounters if each.verdict is Verdict.RECOGNISED]
    scored = [each.error or NO_POSE for each in recognised if each.sequence.world_from_model is not None]
    scans = [each.scan_ms for each in encounters if each.scan_ms is not None]
    return Summary(
        objects=len(encounters),
        kinds=len({each.sequence.category for each in encounters}),
        categories=sum(each.learnt is not None for each in encounters),
        met_again=sum(each.in_memory for each in encounters),
        correct_known=len(recognised),
        false_novel=count[Verdict.FALSE_NOVEL],
        false_known=count[Verdict.FALSE_KNOWN],
        undecided=count[Verdict.UNDECIDED],
        acc30=accuracy(scored, ACC_DEG) if scored else None,
        median_deg=median(errors, "rotation_deg") if errors else None,
        observe_ms=float(np.median([each.observe_ms for each in encounters])),
        scan_ms=float(np.median(scans)) if scans else None,
        total_s=total_s,
    )
