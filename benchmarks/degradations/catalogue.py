"""Every degradation with its strengths."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from zlib import crc32

import numpy as np

from benchmarks.degradations import geometry, picture, scene
from core.views import View

CLUTTER = "clutter"
"""The one that needs things to stand around."""
Apply = Callable[[View, float, np.random.Generator], View]


@dataclass(frozen=True)
class Degradation:
    """One way in which things get worse."""

    name: str
    unit: str
    """Of its strengths, in words."""
    strengths: tuple[float, ...]
    """From mild to bad."""
    none: float
    """The strength at which nothing is changed."""
    apply: Apply
    repaints: bool = True
    """Whether it changes the picture; else only depth or camera."""
    steady: bool = False
    """Whether it is the same in every view of a burst, as a calibration is."""

    def degrade(self, views: Sequence[View], strength: float, name: str, seed: int) -> list[View]:
        """The views of burst `name` at a strength. A stronger one is more of the same: directions and places do not depend on it."""
        keys = [seed, crc32(self.name.encode()), crc32(name.encode())]
        return [self.apply(view, strength, np.random.default_rng([*keys, 0 if self.steady else index])) for index, view in enumerate(views)]


def catalogue(things: Sequence[View]) -> tuple[Degradation, ...]:
    """All of them; `things`, views with masks, stand around in the clutter."""
    return (
        Degradation("depth noise", "mm of deviation at 1 m, growing with its square", (5, 10, 20, 40), 0, geometry.depth_noise, False),
        Degradation("dropout", "share of depth that is missing, in blobs", (0.3, 0.6, 0.8, 0.95), 0, geometry.dropout, False),
        Degradation("camera shift", "mm, each view anew", (2.5, 5, 10, 20), 0, geometry.camera_shift, False),
        Degradation("camera turn", "degrees, each view anew", (0.5, 1, 2, 3), 0, geometry.camera_turn, False),
        Degradation("intrinsics", "percent, focal length and principal point", (1, 2, 5, 10), 0, geometry.intrinsics_error, False, True),
        Degradation("motion blur", "percent of the width", (2, 4, 8), 0, picture.motion_blur),
        Degradation("occlusion", "share of the object that is hidden", (0.15, 0.3, 0.6), 0, scene.occlusion),
        Degradation(CLUTTER, "things around", (2, 4, 8), 0, partial(scene.clutter, things=things)),
        Degradation("resolution", "times fewer pixels a side", (2, 4, 10), 1, picture.resolution),
        Degradation("underexposure", "stops too dark", (2, 4, 6), 0, picture.underexposure),
        Degradation("overexposure", "stops too bright", (1, 2, 3), 0, picture.overexposure),
        Degradation("jpeg", "quality", (20, 10, 5), 95, picture.jpeg),
    )
