"""A camera in a simulated world, and one that plays a recorded folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from clients.datasets.sources import only_sequence
from clients.simulator.replay import ReplayWorld
from clients.simulator.world import World
from core.views import FloatArray, View


@dataclass(frozen=True)
class WorldCamera:
    """Looks into a world."""

    world: World

    def look(self, world_from_camera: FloatArray) -> View:
        """See `base.RobotCamera`."""
        return self.world.capture(world_from_camera)


def recorded(data: Path | str) -> WorldCamera:
    """A camera that answers with the nearest view of one recorded object, each view once before any comes again.

    Raises InvalidInput where `data` (see `sources.find_sequences`) holds several objects, or views without cameras.
    """
    return WorldCamera(ReplayWorld(only_sequence(data)))
