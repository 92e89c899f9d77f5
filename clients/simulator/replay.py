"""A recorded sequence as a world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clients.datasets.folders import Sequence, load_burst
from clients.datasets.viewpoints import aim_point, spread
from clients.simulator.world import WorldObject
from core.camera_poses import nearest_view
from core.views import FloatArray, View


class ReplayWorld:
    """A recorded object: a requested viewpoint is answered by the nearest recorded view.

    Each recorded view is brought once before any is brought again: a copy would tell nothing new.
    """

    def __init__(self, sequence: Sequence) -> None:
        self.sequence = sequence
        self.offsets_deg: list[float] = []
        """How far off each captured view was from what was asked: the angle between both directions about the object."""
        self._recorded = load_burst(sequence)
        self._poses = np.stack([camera.world_from_camera for camera in self._recorded.cameras])
        self._center_m = aim_point(self._recorded.cameras)
        self._unused = set(range(len(self._recorded)))

    @property
    def objects(self) -> list[WorldObject]:
        """The one that was recorded."""
        each = self.sequence
        return [WorldObject(each.category, each.instance, each.world_from_model, each.symmetries)]

    @property
    def center_m(self) -> FloatArray:
        """What the recording cameras aimed at, shape (3,)."""
        return self._center_m

    def viewpoints(self, count: int, seed: int) -> list[FloatArray]:
        """Recorded poses, spread around the object."""
        chosen = spread(self._recorded.cameras, count, seed % len(self._recorded))
        return [self._recorded.cameras[index].world_from_camera for index in chosen]

    def capture(self, world_from_camera: FloatArray) -> View:
        """The nearest recorded view; appends to `offsets_deg` how far off it is."""
        candidates = sorted(self._unused or range(len(self._recorded)))
        position, angle_deg = nearest_view(world_from_camera, self._poses[candidates], self._center_m)
        self._unused.discard(candidates[position])
        self.offsets_deg.append(angle_deg)
        return self._recorded.views[candidates[position]]


@dataclass(frozen=True, eq=False)
class ReplaySubject:
    """A recorded object to be met."""

    sequence: Sequence

    @property
    def category(self) -> str:
        """As recorded."""
        return self.sequence.category

    @property
    def name(self) -> str:
        """`category/instance`."""
        return self.sequence.name

    def enter(self) -> ReplayWorld:
        """A fresh replay: all its views are unused."""
        return ReplayWorld(self.sequence)
