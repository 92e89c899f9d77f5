"""Whether the views of a burst fit together: one object in one place, cameras and depth in one unit, and no image twice.

Letters: V views with cameras and depth on the object.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from core.boxes import cloud_extent_m
from core.encode import EncodedBurst, EncodedView
from core.errors import InvalidInput
from core.quality import ViewFault
from core.views import Burst, FloatArray

MOST_APART = 3.0
"""Times by which depth and cameras may disagree about how far the object is. In 426 bursts of 3, 5 and 8 views of recordings the factor is
0.88 to 1.1; millimetres taken for metres make it 1000."""
LEAST_SPREAD = 0.01
"""Smallest eigenvalue of the mean of I − d dᵀ over the viewing directions: with less (directions within about 8°) rays meet anywhere."""
MOST_MISSED = 0.2
"""Of the distance, by which rays may miss the point where they meet; in the same recordings up to 0.06."""
ELSEWHERE = 1.0
"""Times the object's extent that its middle may seem to be away from where the other views have it; in the same recordings up to 0.47. With
OpenGL's axes taken for OpenCV's, most views exceed it in 97 % of bursts of 3 views and in all of 8; with inverse poses in 78 and 89 %."""
MOST_ELSEWHERE = 0.5
"""Share of the views that may have the object elsewhere: with more, none of them says where it is."""
LEAST_MEASURED = 0.5
"""Share of what was found that must have depth, in the median view: the middle of less, of a shiny object say, is not the object's."""


@dataclass(frozen=True, eq=False)
class _Sights:
    """What each of V views says about where the object is."""

    views: list[int]
    origins: FloatArray
    """Of the cameras, shape (V, 3)."""
    directions: FloatArray
    """Unit vectors to the object's middle in the image, shape (V, 3)."""
    centers: FloatArray
    """Of the object's points by depth, shape (V, 3)."""
    extents_m: FloatArray
    """Of these points, shape (V,)."""
    measured: FloatArray
    """Share of the patches that have such points, shape (V,)."""

    @property
    def away_m(self) -> FloatArray:
        """How far from where the views have the object together each has it, shape (V,)."""
        return np.asarray(np.linalg.norm(self.centers - np.median(self.centers, axis=0), axis=1))

    @property
    def extent_m(self) -> float:
        """Of the object, as most views have it."""
        return float(np.median(self.extents_m))

    @property
    def elsewhere(self) -> NDArray[np.bool_]:
        """Which views have the object too far away, shape (V,)."""
        return np.asarray(self.away_m > ELSEWHERE * self.extent_m)


def require_one_unit(encoded: EncodedBurst) -> None:
    """Raises InvalidInput where the rays to the object meet at quite another distance than depth says."""
    sights = _sights(encoded)
    if sights is None:
        return
    across = np.eye(3) - sights.directions[:, :, None] * sights.directions[:, None, :]
    if np.linalg.eigvalsh(across.mean(axis=0))[0] < LEAST_SPREAD:
        return
    meeting = np.linalg.solve(across.sum(axis=0), (across @ sights.origins[:, :, None]).sum(axis=0)[:, 0])
    to_meeting = meeting - sights.origins
    far = np.linalg.norm(to_meeting, axis=1)
    along = (to_meeting * sights.directions).sum(axis=1)
    missed = np.linalg.norm(to_meeting - along[:, None] * sights.directions, axis=1)
    if (along <= 0).any() or np.median(missed) > MOST_MISSED * np.median(far):
        return
    by_depth = np.linalg.norm(sights.centers - sights.origins, axis=1)
    times = float(np.median(by_depth) / np.median(far))
    if not 1 / MOST_APART <= times <= MOST_APART:
        raise InvalidInput(
            "views",
            f"depth says that the object is {np.median(by_depth):.3g} m from the cameras, world_from_camera says {np.median(far):.3g} m: "
            "send both in metres (depth_scale 0.001 for millimetre images, translations in metres)",
        )


def require_one_place(encoded: EncodedBurst) -> None:
    """Raises InvalidInput where most views have the object elsewhere than the others: their cameras are wrong, or it moved.

    Inverse cameras around the world's origin may escape: by them the object only turns.
    """
    sights = _sights(encoded)
    if sights is None or np.median(sights.measured) < LEAST_MEASURED:
        return
    if sights.elsewhere.mean() > MOST_ELSEWHERE:
        raise InvalidInput(
            "views",
            f"each has the object in another place, {np.median(sights.away_m):.2g} m from the middle of all, though it is "
            f"{sights.extent_m:.2g} m large; where it did not move, world_from_camera is wrong: expected from camera (x right, y down, z "
            "forward, as OpenCV has it) to world, not the inverse and not OpenGL's axes",
        )


def incoherent(burst: Burst, encoded: EncodedBurst) -> tuple[tuple[ViewFault, ...], ...]:
    """What is wrong with each view beside the others."""
    elsewhere = dict(_elsewhere(encoded))
    copies = dict(_copies(burst))
    return tuple(tuple(each[view] for each in (elsewhere, copies) if view in each) for view in range(len(burst)))


def _elsewhere(encoded: EncodedBurst) -> Iterator[tuple[int, ViewFault]]:
    sights = _sights(encoded)
    if sights is None:
        return
    for view, distance_m, elsewhere in zip(sights.views, sights.away_m, sights.elsewhere):
        if elsewhere:
            detail = f"what it shows is {distance_m:.2g} m from where the other views have the object: another object, or a wrong camera"
            yield view, ViewFault("elsewhere", detail)


def _copies(burst: Burst) -> Iterator[tuple[int, ViewFault]]:
    seen: dict[tuple[tuple[int, int], bytes], int] = {}
    for index, view in enumerate(burst.views):
        first = seen.setdefault((view.size, hashlib.blake2b(np.ascontiguousarray(view.rgb).data).digest()), index)
        if first != index:
            yield index, ViewFault("copy", f"is the same image as view {first} and adds nothing; does the camera's stream stand still?")


def _sights(encoded: EncodedBurst) -> _Sights | None:
    """None where fewer than two views have a camera and depth on the object."""
    shown = [(index, view) for index, view in enumerate(encoded.views) if view.camera is not None and view.trusted.any()]
    if len(shown) < 2:
        return None
    clouds = [view.points_m[view.trusted] for _, view in shown]
    rays = [_ray(view) for _, view in shown]
    return _Sights(
        [index for index, _ in shown],
        np.array([origin for origin, _ in rays]),
        np.array([direction for _, direction in rays]),
        np.array([np.median(cloud, axis=0) for cloud in clouds]),
        np.array([cloud_extent_m(cloud) for cloud in clouds]),
        np.array([view.trusted.mean() for _, view in shown]),
    )


def _ray(view: EncodedView) -> tuple[FloatArray, FloatArray]:
    """From the camera to the middle of the object's patches; its direction is a unit vector."""
    assert view.camera is not None
    origin = view.camera.world_from_camera[:3, 3]
    ahead = view.camera.back_project(view.pixels[view.trusted].mean(axis=0), np.array(1.0)) - origin
    return origin, ahead / np.linalg.norm(ahead)
