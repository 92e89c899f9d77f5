"""Whether a view's numbers can be what they are taken for: each is in order by itself, and yet no camera is like this.

Letters: H, W image height and width.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from core.errors import InvalidInput
from core.views import Camera, View

SHORTEST_FOCAL, LONGEST_FOCAL = 0.1, 100.0
"""Times the image's longer side: fields of view of 157° and of half a degree."""
FARTHEST_M = 10_000.0
"""From the world's origin: points are kept in 32 bits, which tell millimetres apart up to there."""
NEAREST_M = 0.001
"""Depth below this was not measured, whatever the number; no depth camera reaches it."""


def plausible(view: View) -> View:
    """The view, without depth that nothing can have measured. Raises InvalidInput naming a part of `view`."""
    if view.camera is not None:
        _require_plausible(view.camera, view.size)
    if view.depth_m is None:
        return view
    stray = (view.depth_m > 0) & (view.depth_m < NEAREST_M)
    return replace(view, depth_m=np.where(stray, np.float32(0), view.depth_m)) if stray.any() else view


def _require_plausible(camera: Camera, size: tuple[int, int]) -> None:
    side = max(size)
    focal = np.array([camera.K[0, 0], camera.K[1, 1]])
    if focal.min() < SHORTEST_FOCAL * side or focal.max() > LONGEST_FOCAL * side or abs(camera.K[0, 1]) > focal.max():
        raise InvalidInput(
            "view.K",
            f"its focal lengths ({focal[0]:.3g}, {focal[1]:.3g}) and skew {camera.K[0, 1]:.3g} are no camera's for an image of "
            f"{size[1]}×{size[0]} pixels; send K in pixels of this image",
        )
    origin_m = float(np.abs(camera.world_from_camera[:3, 3]).max())
    if origin_m > FARTHEST_M:
        raise InvalidInput(
            "view.world_from_camera",
            f"the camera is {origin_m:.3g} m from the world's origin; send metres, in a frame whose origin is within {FARTHEST_M:.0f} m",
        )
