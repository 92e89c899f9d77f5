"""The paper's rearrangement experiment in a world: a reference shown at a goal, then other objects of its category brought there.

For every trial a fresh object stands somewhere else; the robot looks, recognises it, asks for a plan, and carries it out. Errors are
measured against the true pose that the reference had at the goal.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import cv2
import numpy as np

from clients.datasets.images import write_image
from clients.errors import ServiceProblem
from clients.robot import RobotClient
from clients.simulator.arm import UP, Arm, ArmConfig
from clients.simulator.episode import observe_until_sure
from clients.simulator.raycast.categories import RECIPES
from clients.simulator.raycast.mesh import rotation_about
from clients.simulator.raycast.model import Model
from clients.simulator.raycast.sensor import SensorConfig
from clients.simulator.raycast.world import CENTER_M, RaycastWorld, standing
from clients.simulator.scanning import COULD_NOT, learn_from_scan
from core.camera_poses import look_at
from core.sim3 import Sim3, rotation_angle_deg
from core.views import Burst, FloatArray

GOAL_M = (0.0, 0.12)
"""Goals are this far from the table's middle along y, and objects start on the other side of it."""
ASTRAY_M, ASTRAY_DEG = 0.05, 30.0
"""An object that ends farther off than this, or more turned, was not brought to its goal."""
LOOKED_FROM = look_at(np.array([0.42, -0.05, 0.5]), CENTER_M, UP)
"""Where the pictures are taken from."""
TILE = (180, 240)
"""(H, W) of one picture."""
PICTURED = 6


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One object brought to its category's goal, or why it was not."""

    number: int
    name: str = ""
    category: str
    reference: str = ""
    """Both names are empty where the reference could not be shown at the goal."""
    recognised: bool = False
    rotation_deg: float | None = None
    """Between how the object stands in the end and how the reference stood at the goal, modulo its symmetries."""
    position_m: float | None = None
    """Between the middles of their bases."""
    start_rotation_deg: float | None = None
    start_position_m: float | None = None
    """Before; None where the reference could not be shown at the goal."""
    failure: str | None
    motion_s: float = 0.0
    """Simulated."""
    seconds: float


@dataclass(frozen=True, eq=False)
class Shown:
    """A reference that was shown at its category's goal."""

    goal_id: str
    category_id: str
    pose: Sim3
    """In the world."""
    reference: Model
    picture: FloatArray


@dataclass(frozen=True)
class RearrangeSummary:
    """A batch in figures; a trial without a motion counts as wrong in the shares, and is left out of the medians."""

    trials: int
    moved: int
    recognised: int
    acc30: float
    acc15: float
    acc7_5: float
    success: float
    """Percent of the trials that end within ASTRAY_M and ASTRAY_DEG."""
    median_deg: float | None
    median_m: float | None
    start_median_deg: float | None
    start_median_m: float | None
    total_s: float


class Rearrangement:
    """Iterate for the trials; `pictures` grows with them."""

    def __init__(
        self,
        robot: RobotClient,
        categories: Sequence[str],
        trials: int,
        views: int,
        seed: int,
        sensor: SensorConfig | None = None,
        *,
        done: int = 0,
    ) -> None:
        """`done` trials of the same batch were carried out before: the service's memory has their goals."""
        self._done = done
        self._robot = robot
        self._categories = list(categories)
        self._trials = trials
        self._views = views
        self._seed = seed
        self._sensor = sensor
        self._shown: dict[str, Shown] = {}
        self.pictures: list[FloatArray] = []
        """A row for each of the first trials: reference at the goal, the object before, the object brought there; BGR."""

    def __iter__(self) -> Iterator[Trial]:
        for number in range(self._done + 1, self._trials + 1):
            yield self._trial(number, self._categories[(number - 1) % len(self._categories)])

    def pictured(self, trial: Trial) -> bool:
        """Whether `pictures` has grown with a trial."""
        return trial.number <= PICTURED and trial.rotation_deg is not None

    def _trial(self, number: int, category: str) -> Trial:
        started = time.perf_counter()
        try:
            if category not in self._shown:
                self._shown[category] = self._show_goal(category)
        except COULD_NOT as problem:
            return Trial(number=number, category=category, failure=f"no goal: {problem}", seconds=time.perf_counter() - started)
        shown = self._shown[category]
        model = RECIPES[category].make(category, self._seed * 1000 + number)
        world = self._world(number)
        place = np.random.default_rng([self._seed, number])
        start = standing(model, rotation_about("z", float(place.uniform(0, 360))), (float(place.uniform(-0.04, 0.04)), -GOAL_M[1]))
        world.show([model], [start])
        arm = Arm(world, ArmConfig())
        before = _error(model, start, shown)
        burst = arm.glance(self._views, number)
        picture = self._picture(world)
        recognised, ended, failure = self._bring(world, arm, burst, shown)
        after = None if ended is None else _error(model, ended, shown)
        if after is not None and number <= PICTURED:
            self.pictures.append(np.hstack([shown.picture, picture, self._picture(world)]))
        return Trial(
            number=number,
            name=model.name,
            category=category,
            reference=shown.reference.name,
            recognised=recognised,
            rotation_deg=after[0] if after else None,
            position_m=after[1] if after else None,
            start_rotation_deg=before[0],
            start_position_m=before[1],
            failure=failure,
            motion_s=arm.clock_s,
            seconds=time.perf_counter() - started,
        )

    def _bring(self, world: RaycastWorld, arm: Arm, burst: Burst, shown: Shown) -> tuple[bool, Sim3 | None, str | None]:
        """Whether the object was recognised, how it stands once it was brought to the goal, and why it was not brought there."""
        recognised = False
        try:
            seen, _, _ = observe_until_sure(self._robot, arm, burst, learn=False)
            recognised = seen.outcome == "known" and seen.category_id == shown.category_id
            if not recognised:
                return False, None, f"was taken for {self._called(seen.category_id) if seen.category_id else seen.outcome}"
            plan = self._robot.plan(shown.goal_id, seen.id, anchor="base", up=(0.0, 0.0, 1.0))
        except ServiceProblem as problem:
            return recognised, None, str(problem)
        arm.carry(plan.distance_m, plan.angle_deg)
        world.move(0, plan.goal_from_current)
        (ended,) = world.objects
        return True, ended.world_from_model, None

    def _called(self, category_id: str) -> str:
        return next((category for category, shown in self._shown.items() if shown.category_id == category_id), "something else")

    def _show_goal(self, category: str) -> Shown:
        """Learns the category from its reference, then shows the reference at the goal, unless an interrupted run did.

        Raises ServiceProblem, ScanFailed.
        """
        reference = RECIPES[category].make(category, self._seed * 1000)
        visit = 100_000 + self._categories.index(category)
        known = next((each.id for each in self._robot.categories() if each.name == category), None)
        if known is None:
            world = self._world(visit)
            world.show([reference])
            arm = Arm(world, ArmConfig())
            known = learn_from_scan(self._robot, arm, self._views, visit, category).id
        place = np.random.default_rng([self._seed, visit])
        pose = standing(reference, rotation_about("z", float(place.uniform(0, 360))), GOAL_M)
        world = self._world(visit)
        world.show([reference], [pose])
        goals = self._robot.goals(known)
        if not goals:
            seen = self._robot.observe(Arm(world, ArmConfig()).glance(self._views, visit + 1), category_id=known, learn=False)
            goals = [self._robot.set_goal(known, seen.id, name="goal", anchor="base")]
        return Shown(goals[0].id, known, pose, reference, self._picture(world))

    def _world(self, visit: int) -> RaycastWorld:
        return RaycastWorld(self._seed, self._sensor, visit=visit)

    def _picture(self, world: RaycastWorld) -> FloatArray:
        image = cv2.cvtColor(world.capture(LOOKED_FROM).rgb, cv2.COLOR_RGB2BGR)
        return np.asarray(cv2.resize(image, TILE[::-1], interpolation=cv2.INTER_AREA))


def summarise(trials: Sequence[Trial]) -> RearrangeSummary:
    """The figures of a batch."""
    moved = [(each.rotation_deg, each.position_m) for each in trials if each.rotation_deg is not None and each.position_m is not None]

    def share(limit_deg: float, limit_m: float = np.inf) -> float:
        return 100 * sum(degrees <= limit_deg and metres <= limit_m for degrees, metres in moved) / max(1, len(trials))

    return RearrangeSummary(
        trials=len(trials),
        moved=len(moved),
        recognised=sum(each.recognised for each in trials),
        acc30=share(30.0),
        acc15=share(15.0),
        acc7_5=share(7.5),
        success=share(ASTRAY_DEG, ASTRAY_M),
        median_deg=_median([degrees for degrees, _ in moved]),
        median_m=_median([metres for _, metres in moved]),
        start_median_deg=_median([each.start_rotation_deg for each in trials if each.start_rotation_deg is not None]),
        start_median_m=_median([each.start_position_m for each in trials if each.start_position_m is not None]),
        total_s=sum(each.seconds for each in trials),
    )


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None


def write_picture(rows: Sequence[FloatArray], file: Path) -> None:
    """One row a trial."""
    write_image(file, np.vstack(rows), [cv2.IMWRITE_PNG_COMPRESSION, 9])


def drawn_before(file: Path) -> list[FloatArray]:
    """The rows that an interrupted batch has drawn, as one picture; none where it had not come so far."""
    image = cv2.imread(str(file)) if file.is_file() else None
    return [] if image is None else [np.asarray(image)]


def write_json(trials: Sequence[Trial], summary: RearrangeSummary, settings: dict[str, object], file: Path) -> None:
    """Figures and one row a trial."""
    content = {"meta": settings, "summary": asdict(summary), "rows": [asdict(each) for each in trials]}
    file.write_text(json.dumps(content, indent=1), encoding="utf-8")


def _error(model: Model, pose: Sim3, shown: Shown) -> tuple[float, float]:
    """(degrees, metres) between an object's pose and the reference's at the goal."""
    allowed = np.stack([np.eye(3), *model.symmetries])
    turned = shown.pose.rotation.T @ pose.rotation
    degrees = float(rotation_angle_deg(allowed, turned[None]).min())
    return degrees, float(np.linalg.norm(_base(model, pose) - _base(shown.reference, shown.pose)))


def _base(model: Model, pose: Sim3) -> FloatArray:
    """The middle of what a model stands on, in the world, shape (3,)."""
    return pose.apply(np.array([0.0, 0.0, model.mesh.bounds[0][2]]))
