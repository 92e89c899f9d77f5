"""Scans.

Letters: n requested viewpoints.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.views import FloatArray


@dataclass(frozen=True, eq=False)
class ScanRequest:
    """The views to take of a novel object, in the world frame of its burst."""

    id: str
    center_m: FloatArray
    """Centre of the object, shape (3,), metres."""
    up: FloatArray
    """Unit vector the hemisphere of viewpoints opens along, shape (3,)."""
    radius_m: float
    world_from_camera: FloatArray
    """Camera poses, shape (n, 4, 4), metres, OpenCV axes; near ones will do."""
    extent_m: float
    """The object's diameter as far as it was seen."""
    covered: NDArray[np.bool_]
    """Of each viewpoint whether a view was taken near it, shape (n,)."""
    views: int
    """Views received so far; of a completed scan 0."""
    faults: tuple[tuple[str, ...], ...]
    """Of each of them what is wrong with it, in words."""
    views_required: int
    """Fewest views that make a category."""

    @staticmethod
    def from_json(fields: Mapping[str, Any]) -> ScanRequest:
        """From the service's answer."""
        return ScanRequest(
            fields["id"],
            np.array(fields["center_m"]),
            np.array(fields["up"]),
            fields["radius_m"],
            np.array(fields["world_from_camera"]),
            fields["extent_m"],
            np.array(fields["covered"], dtype=bool),
            fields["views"],
            tuple(tuple(fault["detail"] for fault in view["faults"]) for view in fields["received"]),
            fields["views_required"],
        )


class Viewpoints:
    """The viewpoints of a scan, to iterate over."""

    def __init__(self, request: ScanRequest) -> None:
        self.request = request

    @property
    def id(self) -> str:
        """Names it in /v1/scans/{id}."""
        return self.request.id

    def __iter__(self) -> Iterator[FloatArray]:
        """The requested camera poses, each `world_from_camera` of shape (4, 4)."""
        return iter(self.request.world_from_camera)

    def __len__(self) -> int:
        return len(self.request.world_from_camera)
