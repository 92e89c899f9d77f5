"""Worlds a simulated robot can look at: one protocol, and a recorded sequence that follows it."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from clients.datasets.folders import Sequence, load_burst
from clients.datasets.viewpoints import aim_point, spread
from core.scan import nearest_view
from core.views import Burst, FloatArray, View


class World(Protocol):
    """Something a camera can be moved about in."""

    def capture(self, world_from_camera: FloatArray) -> View:
        """The view from a pose, shape (4, 4), or from as near to it as this world can; the view's camera says where it was taken."""
        ...


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

    def capture(self, world_from_camera: FloatArray) -> View:
        """The nearest recorded view; appends to `offsets_deg` how far off it is."""
        candidates = sorted(self._unused or range(len(self._recorded)))
        position, angle_deg = nearest_view(world_from_camera, self._poses[candidates], self._center_m)
        self._unused.discard(candidates[position])
        self.offsets_deg.append(angle_deg)
        return self._recorded.views[candidates[position]]

    def glance(self, count: int | None = None, first: int = 0) -> Burst:
        """`count` recorded views (all where left out) spread around the object: what a robot sees before it is asked for any viewpoint."""
        return self._recorded.select(spread(self._recorded.cameras, count or len(self._recorded), first % len(self._recorded)))
