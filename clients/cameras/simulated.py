"""A camera in a simulated world, and one that plays a recorded folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from clients.datasets.sources import find_sequences
from clients.simulator.replay import ReplayWorld
from clients.simulator.world import World
from core.errors import InvalidInput
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
    sequences = find_sequences(data)
    if len(sequences) > 1:
        raise InvalidInput("data", f"{data} holds {len(sequences)} objects; name one, such as {sequences[0].path}")
    return WorldCamera(ReplayWorld(sequences[0]))
