"""An episode: a robot meets objects one by one (paper, "Continual category learning").

Everything that is scored comes from the service's answers; the ground truth stays with the simulator.
"""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Iterator, Sequence, Set
from dataclasses import dataclass, field

from clients.answers.categories import Category
from clients.errors import ClientError, NoObjectProblem
from clients.pose_error import PoseError, pose_error
from clients.robot import Observation, RobotClient
from clients.simulator.arm import FREE, Arm, ArmConfig
from clients.simulator.encounter import Encounter, Founder, Verdict, judge
from clients.simulator.scanning import COULD_NOT, ScanReport, carry_out
from clients.simulator.waypoints import Visit, visit_waypoints
from clients.simulator.world import Subject, WorldObject
from core.views import Burst

MOST_LOOKS = 3
"""Observations of one object at most: after two rounds of further views a robot goes on."""


@dataclass
class Truth:
    """Which true object founded each of the service's categories; shared by all robots of one memory."""

    founders: dict[str, Founder] = field(default_factory=dict)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def founder(self, category_id: str | None) -> Founder | None:
        """Who founded a category."""
        with self.lock:
            return self.founders.get(category_id or "")

    def has(self, category: str) -> bool:
        """Whether an object of a true category founded one."""
        with self.lock:
            return any(each.category == category for each in self.founders.values())

    def add(self, category_id: str, founder: Founder) -> None:
        """Says who founded a new category."""
        with self.lock:
            self.founders[category_id] = founder


@dataclass(frozen=True)
class Conduct:
    """How a robot goes about an episode."""

    views: int = 8
    """In the burst of each encounter."""
    seed: int = 0
    """Of the viewpoints and of what is lost."""
    arm: ArmConfig = FREE
    lost_views: float = 0.0
    """Share of views that never arrive: a fault to be lived with."""
    waypoints: int = 0
    """From which an object taken for known is looked at once more, each view by itself."""


class Episode:
    """Meets subjects in order; `done` are the encounters of an earlier, interrupted run of the same episode."""

    def __init__(
        self,
        robot: RobotClient,
        subjects: Sequence[Subject],
        conduct: Conduct,
        *,
        done: Sequence[Encounter] = (),
        truth: Truth | None = None,
        number: int = 0,
    ) -> None:
        """`number` tells robots of one memory apart, whose `truth` they share. What the memory holds besides, nobody is asked about here:
        see `require_own_memory`."""
        self._robot = robot
        self._conduct = conduct
        self._truth = truth or Truth()
        self._number = number
        self.subjects = list(subjects)
        self._met = len(done)
        for each in done:
            if each.learnt is not None:
                self._truth.add(each.learnt, each.founder)

    def __iter__(self) -> Iterator[Encounter]:
        for number, subject in enumerate(self.subjects, start=1):
            if number > self._met:
                yield self.meet(number, subject)

    def meet(self, number: int, subject: Subject) -> Encounter:
        """One encounter."""
        chance = random.Random(self._conduct.seed * 100_003 + self._number * 10_007 + number)
        world = subject.enter()
        (thing,) = world.objects
        arm = Arm(world, self._conduct.arm)
        burst = self._without_lost(arm.glance(self._conduct.views, chance.randrange(1 << 16)), chance)
        arm.offsets_deg.clear()
        decided = self._decided(arm, thing, burst)
        scanned = _scanned(decided.seen, arm)
        if scanned.learnt is not None:
            self._truth.add(scanned.learnt.id, Founder.of(thing))
        visit = Visit()
        if decided.seen.outcome == "known" and self._conduct.waypoints:
            visit = visit_waypoints(
                self._robot, arm, decided.seen, decided.burst, self._conduct.waypoints, chance.randrange(1 << 16), decided.error
            )
        return self._encounter(number, arm, decided, scanned, visit)

    def _decided(self, arm: Arm, thing: WorldObject, burst: Burst) -> _Decided:
        in_memory = self._truth.has(thing.category)
        started = time.perf_counter()
        try:
            seen, burst, looks = observe_until_sure(self._robot, arm, burst)
        except NoObjectProblem as problem:
            seen, looks = _nothing_seen(problem), 1
        ms = (time.perf_counter() - started) * 1e3
        founder = self._truth.founder(seen.category_id)
        verdict = judge(seen.outcome, thing.category, founder, in_memory)
        return _Decided(thing, seen, burst, looks, in_memory, founder, verdict, ms)

    def _encounter(self, number: int, arm: Arm, decided: _Decided, scanned: _Scanned, visit: Visit) -> Encounter:
        thing, seen, founder, learnt = decided.thing, decided.seen, decided.founder, scanned.learnt
        most_similar = seen.similarities[0] if seen.similarities else None
        nearest = self._truth.founder(most_similar.category_id) if most_similar else None
        return Encounter(
            number=number,
            name=thing.name,
            category=thing.category,
            observation_id=seen.id,
            outcome=seen.outcome,
            verdict=decided.verdict,
            category_id=seen.category_id,
            kind=founder.category if founder else None,
            nearest_kind=nearest.category if nearest else None,
            similarity=most_similar.similarity if most_similar else None,
            threshold=seen.threshold,
            in_memory=decided.in_memory,
            has_truth=thing.world_from_model is not None,
            error=decided.error(seen),
            learnt=learnt.id if learnt else None,
            learnt_views=learnt.views if learnt else 0,
            founder_matrix=thing.world_from_model.as_matrix().tolist() if learnt and thing.world_from_model else None,
            best_view=0 if seen.pose is None else seen.pose.best_view,
            views=len(decided.burst),
            looks=decided.looks,
            offsets_deg=tuple(arm.offsets_deg),
            refused=arm.refused + len(scanned.report.out_of_reach),
            view_faults=tuple(scanned.report.faults),
            failure=scanned.failure,
            observe_ms=decided.ms,
            scan_ms=scanned.ms,
            motion_s=arm.clock_s,
            timings_ms=dict(seen.timings_ms),
            robot=self._number,
            waypoints=visit.waypoints,
            waypoints_out_of_reach=visit.out_of_reach,
        )

    def _without_lost(self, burst: Burst, chance: random.Random) -> Burst:
        kept = [index for index in range(len(burst)) if chance.random() >= self._conduct.lost_views]
        return burst.select(kept or [0])


def observe_until_sure(robot: RobotClient, arm: Arm, burst: Burst, *, learn: bool = True) -> tuple[Observation, Burst, int]:
    """What the service says in the end, all views, and how often it was asked: where it is uncertain it gets the views that it asks for."""
    for looks in range(1, MOST_LOOKS + 1):
        seen = robot.observe(burst, learn=learn)
        if seen.outcome != "uncertain" or seen.viewpoints is None or looks == MOST_LOOKS:
            break
        more = list(arm.look_around(list(seen.viewpoints), arm.world.center_m))
        if not more:
            break
        burst = Burst([*burst.views, *more])
    return seen, burst, looks


def require_own_memory(robot: RobotClient, own: Set[str | None]) -> None:
    """Raises ClientError where the service's memory holds categories other than those that this run has made so far."""
    if {each.id for each in robot.categories()} - own:
        remedy = "start one with `onelook serve --data-dir NEW_FOLDER`"
        raise ClientError(f"the service's memory is not empty, so decisions could not be scored; {remedy}")


def shuffled(subjects: Sequence[Subject], seed: int) -> list[Subject]:
    """In an order that depends on the seed alone."""
    order = list(subjects)
    random.Random(seed).shuffle(order)
    return order


def _nothing_seen(problem: NoObjectProblem) -> Observation:
    """In place of an observation that there is none of: the robot goes on to the next object."""
    return Observation("", "uncertain", None, None, None, str(problem), None, None, (), None, {"total": 0.0}, {})


@dataclass(frozen=True)
class _Decided:
    """What the service said of an object in the end, and what that was worth."""

    thing: WorldObject
    seen: Observation
    burst: Burst
    """The views it was said of, further ones included."""
    looks: int
    in_memory: bool
    """Whether an object of the thing's category had founded one before."""
    founder: Founder | None
    """Of the category decided for."""
    verdict: Verdict
    ms: float

    def error(self, answer: Observation) -> PoseError | None:
        """Of an answer's pose, where the thing was rightly recognised and both true poses are known."""
        thing, founder = self.thing, self.founder
        if self.verdict is not Verdict.RECOGNISED or answer.pose is None or founder is None:
            return None
        if founder.world_from_model is None or thing.world_from_model is None:
            return None
        return pose_error(answer.pose.target_from_reference, founder.world_from_model, thing.world_from_model, thing.symmetries)


@dataclass(frozen=True)
class _Scanned:
    """What came of an answer's scan, where it asked for one."""

    learnt: Category | None
    failure: str | None
    """Why there is no category, or no pose."""
    ms: float | None
    report: ScanReport


def _scanned(seen: Observation, arm: Arm) -> _Scanned:
    report = ScanReport()
    if seen.scan is None:
        return _Scanned(None, seen.pose_error or seen.scan_error, None, report)
    learnt, failure, started = None, None, time.perf_counter()
    try:
        learnt = carry_out(arm, seen.scan, report=report)
    except COULD_NOT as problem:
        failure = str(problem)
    return _Scanned(learnt, failure, (time.perf_counter() - started) * 1e3, report)
