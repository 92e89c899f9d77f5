"""What `static/viewer.js` draws: clouds, boxes and cameras as JSON. Letters: N points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.boxes import OrientedBox
from core.encode import EncodedView
from core.reference import Reference
from core.scan import infer_up
from core.views import Burst, Camera, FloatArray, View
from service.pictures import ComponentColours, mask_picture

Part = dict[str, Any]
MOST_POINTS = 14_000
"""Of a surface: each is about 40 bytes of JSON."""
CELLS = 80
"""Of a surface, along its longest edge."""
BESIDE = 1.05
"""Points up to this multiple of the box are the object's; what is farther is background at its edge."""
PLACES = 4
"""Decimals of a coordinate: a tenth of a millimetre."""


def cloud(
    name: str, points_m: FloatArray, colour: str = "plain", *, colours: NDArray[np.uint8] | None = None, choice: str | None = None
) -> Part:
    """Points, shape (N, 3), all in one of the colours `plain`, `reference` and `target`, or each in its own, shape (N, 3).

    Clouds with different choices are shown in each other's place.
    """
    part: Part = {"name": name, "points": np.round(points_m, PLACES).ravel().tolist(), "colour": colour, "choice": choice}
    return part | ({} if colours is None else {"colours": colours.ravel().tolist()})


def box(name: str, oriented: OrientedBox, colour: str = "plain") -> Part:
    """An oriented box."""
    return {"name": name, "corners": np.round(oriented.corners(), PLACES).tolist(), "colour": colour}


def camera(seen_by: Camera, size: tuple[int, int]) -> Part:
    """A camera whose pictures have this (height, width)."""
    return {"world_from_camera": seen_by.world_from_camera.tolist(), "K": seen_by.K.tolist(), "size": list(size)}


def scene(clouds: Sequence[Part], boxes: Sequence[Part] = (), cameras: Sequence[Part] = (), up: FloatArray | None = None) -> Part:
    """All of it, in one world frame, metres."""
    return {"clouds": list(clouds), "boxes": list(boxes), "cameras": list(cameras), "up": None if up is None else np.asarray(up).tolist()}


def reference_scene(reference: Reference, burst: Burst) -> Part:
    """A category: its surface in the colours of the images and of its components, its box, and where it was seen from."""
    surface, colours = object_surface(burst, reference.views, reference.box)
    trusted = [(view.points_m[view.trusted], view.descriptors[view.trusted]) for view in reference.views]
    points = np.concatenate([each for each, _ in trusted])
    painted = ComponentColours.of(reference.basis, reference.views).paint(np.concatenate([each for _, each in trusted]))
    near = reference.box.holds(points, BESIDE)
    clouds = [
        cloud("surface", surface, colours=colours, choice="Image"),
        cloud("patches", points[near], colours=painted[near].astype(np.uint8), choice="Components"),
    ]
    cameras = [camera(view.camera, view.size) for view in burst.views if view.camera is not None]
    up, _ = infer_up(burst.cameras)
    return scene([each for each in clouds if each["points"]], [box("box", reference.box)], cameras, up)


def object_surface(burst: Burst, encoded: Sequence[EncodedView], oriented: OrientedBox) -> tuple[FloatArray, NDArray[np.uint8]]:
    """What the depth images measured of the object, shape (N, 3), metres in the burst's world, and its colours."""
    parts = [_surface(view, each, oriented) for view, each in zip(burst.views, encoded) if view.depth_m is not None]
    points, colours = (np.concatenate([part[index] for part in parts]) if parts else np.empty((0, 3)) for index in (0, 1))
    kept = _evenly(points, float(oriented.extent_m.max()) / CELLS)
    return points[kept], colours[kept].astype(np.uint8)


def _evenly(points: FloatArray, cell_m: float) -> NDArray[np.intp]:
    """One point of each cell of a grid, and at most MOST_POINTS: sides that few views show are as dense as those that many do."""
    cells = np.floor(points / max(cell_m, 1e-6)).astype(np.int64)
    _, first = np.unique(cells, axis=0, return_index=True)
    return np.sort(first)[np.linspace(0, len(first) - 1, min(len(first), MOST_POINTS)).astype(int)]


def _surface(view: View, encoded: EncodedView, oriented: OrientedBox) -> tuple[FloatArray, NDArray[np.uint8]]:
    assert view.depth_m is not None
    assert view.camera is not None
    rows, columns = np.nonzero((mask_picture(view, encoded)[..., 0] > 0) & (view.depth_m > 0))
    points = view.camera.back_project(np.stack([columns, rows], axis=-1).astype(float), view.depth_m[rows, columns])
    near = oriented.holds(points, BESIDE)
    return points[near], view.rgb[rows, columns][near]
