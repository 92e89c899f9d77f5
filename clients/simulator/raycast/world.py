"""The rendered world: objects on a table in a room, seen by one camera."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from clients.simulator.raycast.mesh import rotation_about
from clients.simulator.raycast.model import Model
from clients.simulator.raycast.render import LitScene
from clients.simulator.raycast.room import Room, make_room
from clients.simulator.raycast.sensor import Sensor, SensorConfig
from clients.simulator.world import WorldObject
from core.camera_poses import hemisphere
from core.sim3 import Sim3
from core.views import FloatArray, View

UP = np.array([0.0, 0.0, 1.0])
CENTER_M = np.array([0.0, 0.0, 0.08])
"""What a robot looks at before it knows better: a little above the table's middle."""
DISTANCE_M = 0.58
"""From where it looks: objects of the simulator fill a third of the image or more."""
SCATTER_M = 0.05
"""Objects are put this far from the table's middle at most."""


class RaycastWorld:
    """See module. World frame: the table's top is z = 0, its middle the origin, metres.

    Letters: V views.
    """

    def __init__(self, seed: int, sensor: SensorConfig | None = None, *, visit: int = 0) -> None:
        """`seed` decides room, lamps and the camera's calibration; with `visit`, its noise and where objects are put."""
        self._room = _room(seed)
        self._sensor = Sensor(sensor or SensorConfig(), np.random.default_rng([seed, 1]), np.random.default_rng([seed, 2, visit]))
        self._placing = np.random.default_rng([seed, 3, visit])
        self._models: list[Model] = []
        self._poses: list[Sim3] = []
        self._scene: LitScene | None = None

    @property
    def objects(self) -> list[WorldObject]:
        """What is on the table."""
        return [
            WorldObject(model.category, model.instance, pose, model.symmetries)
            for model, pose in zip(self._models, self._poses, strict=True)
        ]

    @property
    def center_m(self) -> FloatArray:
        """A little above the table's middle, shape (3,)."""
        return CENTER_M

    def show(self, models: Sequence[Model], world_from_model: Sequence[Sim3] | None = None) -> None:
        """Clears the table and puts these on it: somewhere near its middle, turned anyhow, unless poses are given."""
        self._models = list(models)
        self._poses = list(world_from_model) if world_from_model else [self.somewhere(model) for model in models]
        self._scene = None

    def somewhere(self, model: Model) -> Sim3:
        """A pose in which a model stands on the table, near its middle, turned anyhow about the vertical: world_from_model."""
        x, y = self._placing.uniform(-SCATTER_M, SCATTER_M, 2)
        rotation = rotation_about("z", float(self._placing.uniform(0, 360)))
        return standing(model, rotation, (float(x), float(y)))

    def move(self, index: int, motion: FloatArray) -> None:
        """Carries out a rigid motion of an object, shape (4, 4), in the world frame."""
        self._poses[index] = Sim3(1.0, motion[:3, :3], motion[:3, 3]) @ self._poses[index]
        self._scene = None

    def viewpoints(self, count: int, seed: int) -> list[FloatArray]:
        """Poses on a hemisphere above the table's middle, the first from a random side."""
        turn = np.eye(4)
        turn[:3, :3] = rotation_about("z", float(np.random.default_rng(seed).uniform(0, 360)))
        return [turn @ pose for pose in hemisphere(CENTER_M, UP, DISTANCE_M, count)]

    def capture(self, world_from_camera: FloatArray) -> View:
        """What the camera sees from a pose, with the faults that such cameras have; the view's camera is the pose asked for."""
        return self._sensor.look(self._lit(), world_from_camera)

    def capture_with_mask(self, world_from_camera: FloatArray, index: int = 0) -> View:
        """The same, with the exact silhouette of an object, for evaluation."""
        return self._sensor.look(self._lit(), world_from_camera, mask_of=index)

    def _lit(self) -> LitScene:
        if self._scene is None:
            placed = zip(self._models, self._poses, strict=True)
            self._scene = LitScene(self._room, [replace(model.mesh, vertices=pose.apply(model.mesh.vertices)) for model, pose in placed])
        return self._scene


@lru_cache(maxsize=8)
def _room(seed: int) -> Room:
    return make_room(np.random.default_rng([seed, 0]))


def standing(model: Model, rotation: FloatArray, place_m: tuple[float, float]) -> Sim3:
    """world_from_model of a model turned by `rotation`, shape (3, 3), that stands on the table, its box's middle above (x, y)."""
    lowest = float((model.mesh.vertices @ rotation.T)[:, 2].min()) * model.size_m
    return Sim3(model.size_m, rotation, np.array([*place_m, -lowest]))


@dataclass(frozen=True, eq=False)
class RaycastSubject:
    """An object to be put on the table of a world, the same one for all objects of a seed."""

    model: Model
    seed: int
    """Of the world."""
    visit: int
    """Of this object; see `RaycastWorld`."""
    sensor: SensorConfig | None = None

    @property
    def category(self) -> str:
        """The model's."""
        return self.model.category

    @property
    def name(self) -> str:
        """`category/instance`."""
        return self.model.name

    def enter(self) -> RaycastWorld:
        """The world, with only this object on the table."""
        world = RaycastWorld(self.seed, self.sensor, visit=self.visit)
        world.show([self.model])
        return world
