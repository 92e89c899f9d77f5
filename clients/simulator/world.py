"""Worlds a simulated robot can look at: one protocol for recorded and rendered ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from core.sim3 import Sim3
from core.views import FloatArray, View


@dataclass(frozen=True, eq=False)
class WorldObject:
    """One object as the ground truth knows it; the service never sees any of this."""

    category: str
    instance: str
    world_from_model: Sim3 | None
    """The model frame (bounding-box centre 0, diagonal 1, one orientation a category) in the world, metres; None where nobody knows it."""
    symmetries: tuple[FloatArray, ...] = ()
    """Rotations of the model onto itself, identity left out, each of shape (3, 3)."""

    @property
    def name(self) -> str:
        """`category/instance`."""
        return f"{self.category}/{self.instance}"


class World(Protocol):
    """Something with objects in it that a camera can be moved about in."""

    @property
    def objects(self) -> Sequence[WorldObject]:
        """What is there now."""
        ...

    @property
    def center_m(self) -> FloatArray:
        """Where objects are to be expected, shape (3,)."""
        ...

    def viewpoints(self, count: int, seed: int) -> list[FloatArray]:
        """Camera poses, each of shape (4, 4), that look at the middle from all around: where a robot looks from before it is asked."""
        ...

    def capture(self, world_from_camera: FloatArray) -> View:
        """The view from a pose, shape (4, 4), or from as near to it as this world can; the view's camera says where it was taken."""
        ...


class Subject(Protocol):
    """An object that a robot can be made to meet."""

    @property
    def category(self) -> str:
        """Its true category."""
        ...

    @property
    def name(self) -> str:
        """`category/instance`."""
        ...

    def enter(self) -> World:
        """The world with this object in it, and no other."""
        ...
