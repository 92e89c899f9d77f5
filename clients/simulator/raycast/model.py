"""What a category of the simulator is: a recipe that makes one more object for every seed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from clients.simulator.raycast.mesh import Mesh
from core.views import FloatArray


@dataclass(frozen=True, eq=False)
class Model:
    """One object in its own frame: z up, x to the front, bounding box about the origin with a diagonal of 1."""

    category: str
    instance: str
    mesh: Mesh
    size_m: float
    """Diagonal of the bounding box."""
    symmetries: tuple[FloatArray, ...] = ()
    """Rotations onto itself, identity left out, each of shape (3, 3)."""

    @property
    def name(self) -> str:
        """`category/instance`."""
        return f"{self.category}/{self.instance}"


@dataclass(frozen=True)
class Recipe:
    """How objects of one category are made."""

    build: Callable[[np.random.Generator], list[Mesh]]
    """Parts of an object, in any unit, z up and x to the front."""
    size_m: tuple[float, float]
    """Diagonals that its objects have, least and most."""
    symmetries: tuple[FloatArray, ...] = ()

    def make(self, category: str, seed: int) -> Model:
        """The object of a seed."""
        rng = np.random.default_rng([seed, *category.encode()])
        mesh = Mesh.join(self.build(rng)).unit()
        return Model(category, f"{category}_{seed}", mesh, float(rng.uniform(*self.size_m)), self.symmetries)
