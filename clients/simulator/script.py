"""An episode as a small YAML file says it."""

from __future__ import annotations

import random
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Annotated, Literal

import yaml
from pydantic import ConfigDict, Field, StrictBool, StrictFloat, StrictInt, TypeAdapter, ValidationError

from clients.datasets.folders import by_category
from clients.datasets.samples import data_or_samples
from clients.datasets.sources import find_sequences
from clients.simulator.arm import FREE, ArmConfig
from clients.simulator.episode import Conduct, shuffled
from clients.simulator.replay import ReplaySubject
from clients.simulator.world import Subject
from core.errors import InvalidInput

NO_OTHERS = ConfigDict(extra="forbid")
"""Names that are no field are refused."""
Positive = Annotated[StrictInt, Field(ge=1)]
DRAWN_CATEGORIES = 5
"""Where a script names none."""
ROBOT_SEEDS = 1_000
"""Between the seeds of robots that share a memory."""


@dataclass(frozen=True)
class Faults:
    """What goes wrong on purpose."""

    __pydantic_config__ = NO_OTHERS

    lost_views: Annotated[StrictFloat, Field(ge=0, lt=1)] = 0.0
    """Share of views that never arrive."""
    sensor: Mapping[str, StrictFloat] = field(default_factory=dict)
    """Settings of the rendered world's camera, such as `disparity_noise_px: 0.3`."""


@dataclass(frozen=True)
class Script:
    """See module; every field may be left out."""

    __pydantic_config__ = NO_OTHERS

    world: Literal["raycast", "replay"] = "raycast"
    """`raycast` renders, `replay` plays recordings."""
    data: str | None = None
    """Recordings for `replay`; the samples of the repository where left out."""
    meshes: str | None = None
    """Meshes of a user's own for `raycast`, in place of the simulator's categories."""
    categories: tuple[str, ...] = ()
    """Which to draw objects from; five drawn by the seed where left out."""
    instances: Positive = 3
    """Objects of each category."""
    length: Positive | None = None
    """Objects met; some repeatedly where there are fewer. Each once where left out."""
    order: Literal["random", "grouped"] = "random"
    """`random`, or `grouped`: one category after the other."""
    views: Positive = 8
    """In the burst of each encounter."""
    waypoints: Annotated[StrictInt, Field(ge=0)] = 0
    """Random ones from which an object taken for known is looked at once more, each view by itself."""
    seed: Annotated[StrictInt, Field(ge=0)] = 0
    robots: Positive = 1
    """That share the memory, each in a world of its own."""
    teacher: StrictBool = False
    """Whether a teacher teaches, asks and corrects, in place of the robot's own discovery."""
    faults: Faults = Faults()

    def conduct(self) -> Conduct:
        """How robots go about it: on an arm in the rendered world, anywhere in a recording."""
        arm = ArmConfig() if self.world == "raycast" else FREE
        return Conduct(self.views, self.seed, arm, self.faults.lost_views, self.waypoints)

    def subjects(self, robot: int = 0) -> list[Subject]:
        """What a robot meets, in order."""
        pool = self._raycast(robot) if self.world == "raycast" else self._replay()
        drawn = pool if self.order == "grouped" else shuffled(pool, self.seed + ROBOT_SEEDS * robot)
        if self.length is None:
            return drawn
        more = random.Random(self.seed + ROBOT_SEEDS * robot)
        return [*drawn, *(more.choice(drawn) for _ in range(self.length - len(drawn)))][: self.length]

    def as_settings(self) -> dict[str, object]:
        """What differs from the defaults, and the world, the seed and the views."""
        plain = asdict(self)
        default = asdict(Script())
        kept = {name: value for name, value in plain.items() if name in {"world", "seed", "views"} or value != default[name]}
        return {name: Path(str(value)).name if name in {"data", "meshes"} else value for name, value in kept.items()}

    def _raycast(self, robot: int) -> list[Subject]:
        from clients.simulator.raycast.categories import RECIPES
        from clients.simulator.raycast.export import draw_models
        from clients.simulator.raycast.sensor import SensorConfig
        from clients.simulator.raycast.user_meshes import find_models
        from clients.simulator.raycast.world import RaycastSubject

        settings = [each.name for each in fields(SensorConfig) if isinstance(each.default, float)]
        for name in self.faults.sensor:
            if name not in settings:
                raise InvalidInput(f"faults.sensor.{name}", f"is none of {', '.join(settings)}")
        sensor: SensorConfig = replace(SensorConfig(), **self.faults.sensor)  # type: ignore[arg-type]  # one type a setting
        if self.meshes is not None:
            models = find_models(Path(self.meshes))
        else:
            chosen = self.categories or sorted(random.Random(self.seed).sample(sorted(RECIPES), DRAWN_CATEGORIES))
            models = draw_models(chosen, self.instances, self.seed + ROBOT_SEEDS * robot)
        seed = self.seed + ROBOT_SEEDS * robot
        return [RaycastSubject(model, seed, visit, sensor) for visit, model in enumerate(models)]

    def _replay(self) -> list[Subject]:
        groups = by_category(find_sequences(str(data_or_samples(Path(self.data) if self.data else None))))
        unknown = set(self.categories) - set(groups)
        if unknown:
            raise InvalidInput("categories", f"{', '.join(sorted(unknown))}: not in the recordings, which have {', '.join(groups)}")
        chosen = self.categories or tuple(groups)
        return [ReplaySubject(sequence) for category in chosen for sequence in groups[category][: self.instances]]


def read_script(file: Path) -> Script:
    """A script from a YAML file. Raises InvalidInput naming the field that is wrong."""
    if not file.is_file():
        raise InvalidInput("script", f"there is no file {file}; name a YAML file, or leave it out for the demo")
    try:
        content = yaml.safe_load(file.read_text(encoding="utf-8"))
    except yaml.YAMLError as error:
        raise InvalidInput("script", f"{file} is not YAML: {error}") from None
    return script_from(content or {})


def script_from(content: object) -> Script:
    """A script from what YAML holds. Raises InvalidInput naming the field that is wrong."""
    try:
        return check(TypeAdapter(Script).validate_python(content))
    except ValidationError as error:
        first = error.errors()[0]
        field = ".".join(str(part) for part in first["loc"]) or "script"
        if first["type"] == "unexpected_keyword_argument":
            known = fields(Faults if field.startswith("faults.") else Script)
            raise InvalidInput(field, f"is none of {', '.join(each.name for each in known)}") from None
        raise InvalidInput(field, f"{first['msg']}, found {first['input']!r:.60}") from None


def check(script: Script) -> Script:
    """The script itself. Raises InvalidInput naming the field that does not go with the others."""
    if script.waypoints and script.teacher:
        raise InvalidInput("waypoints", "are not visited where a teacher asks: leave them or the teacher out")
    if script.robots > 1 and script.teacher:
        raise InvalidInput("robots", "share no teacher: she teaches one; leave her or the other robots out")
    if script.faults.lost_views and script.teacher:
        raise InvalidInput("faults.lost_views", "are not lost where a teacher asks: leave them or the teacher out")
    if script.categories and script.meshes:
        raise InvalidInput("categories", "are the simulator's own or the recordings': leave them or the meshes out")
    if script.world != "raycast" and (script.meshes or script.faults.sensor):
        raise InvalidInput("meshes" if script.meshes else "faults.sensor", "is for the world `raycast`: recordings are as they are")
    if script.world != "replay" and script.data:
        raise InvalidInput("data", "is for the world `replay`: name the world, or leave the recordings out")
    return script
