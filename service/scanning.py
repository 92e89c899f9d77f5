"""Scans: viewpoints asked for, views accepted one by one with what is wrong with them, and in the end a category."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from core.errors import InvalidInput, TooFewViews
from core.look import Encodes, look
from core.packing import burst_from_arrays
from core.quality import ViewFault, faults, region_of_mask, region_of_sphere
from core.reference import MIN_VIEWS, build_reference
from core.scan import Coverage, ScanOptions, ScanRequest, coverage, exclude, request_scan
from core.views import Burst, View
from service.events import Events
from store.memory import Memory
from store.records import Category, Scan


@dataclass(frozen=True)
class Progress:
    """How far a scan is."""

    coverage: Coverage
    faults: tuple[tuple[ViewFault, ...], ...]
    """Of each view received, in their order."""


class Scanning:
    """The scans of one memory."""

    def __init__(self, encoder: Encodes, memory: Memory, events: Events, viewpoints: int) -> None:
        """`viewpoints` is how many a scan asks for where its caller does not say."""
        self._encoder = encoder
        self._memory = memory
        self._events = events
        self._viewpoints = viewpoints

    def begin(self, source: Burst | str, options: ScanOptions | None = None) -> Scan:
        """A scan of the object of a burst, or of an observation by its id.

        Raises InvalidInput where cameras or depth are missing, NoObject, NotFound.
        """
        if isinstance(source, str):
            encoded, observation_id = burst_from_arrays(self._memory.observations.features(source)), source
        else:
            encoded, observation_id = look(source, self._encoder).encoded, None
        request = request_scan(encoded, options or ScanOptions(self._viewpoints))
        scan = self._memory.scans.create(request, observation_id)
        self._events.publish("scan_begun", id=scan.id, observation_id=observation_id)
        return scan

    def exclude(self, scan_id: str, unreachable: Sequence[int]) -> Scan:
        """Replaces viewpoints that the robot cannot reach. Raises NotFound, Conflict where it is over, InvalidInput."""
        scan = self._memory.scans.require_open(scan_id)
        replaced = self._memory.scans.replace_request(scan_id, exclude(scan.request, unreachable))
        self._events.publish("scan_changed", id=scan_id)
        return replaced

    def add(self, scan_id: str, burst: Burst) -> Scan:
        """Keeps views for a scan. Raises NotFound, Conflict where it is over, InvalidInput for views without camera or depth."""
        scan = self._memory.scans.require_open(scan_id)
        for index, view in enumerate(burst.views):
            for name, value in (("K", view.camera), ("depth", view.depth_m)):
                if value is None:
                    raise InvalidInput(
                        f"views[{index}].{name}", "is missing: a reference is made of views with K, world_from_camera and depth"
                    )
        added = self._memory.scans.add(scan_id, burst, [_report(scan.request, view) for view in burst.views])
        self._events.publish("scan_views", id=scan_id, views=added.views)
        return added

    def progress(self, scan: Scan) -> Progress:
        """Of a scan's views so far."""
        views = [view for burst in self._memory.scans.reports(scan.id) for view in burst or ()]
        found = tuple(tuple(ViewFault(**fault) for fault in view["faults"]) for view in views)
        return Progress(coverage(scan.request, [np.array(view["world_from_camera"]) for view in views]), found)

    def complete(self, scan_id: str, name: str | None = None, *, actor: str | None = None) -> Category:
        """Makes the views of a scan a category, in one step. Raises TooFewViews, NoObject, NotFound, Conflict."""
        scan = self._memory.scans.require_open(scan_id)
        burst = self._memory.scans.burst(scan_id)
        if burst is None or len(burst) < MIN_VIEWS:
            found = f"the scan has {scan.views} of at least {MIN_VIEWS} views"
            raise TooFewViews("views", f"{found}; send {MIN_VIEWS - scan.views} more to /v1/scans/{scan_id}/views, from other sides")
        encoded = look(burst, self._encoder).encoded
        category = self._memory.categories.create(build_reference(encoded), burst, encoded, name=name, scan_id=scan_id, actor=actor)
        self._events.publish("category_created", id=category.id, name=name, scan_id=scan_id)
        return category

    def delete(self, scan_id: str) -> None:
        """Forgets a scan and its views. Raises NotFound."""
        self._memory.scans.delete(scan_id)
        self._events.publish("scan_deleted", id=scan_id)


def _report(request: ScanRequest, view: View) -> dict[str, object]:
    """What is kept of a view beside its pictures."""
    assert view.camera is not None
    sphere = region_of_sphere(view.camera, request.center_m, request.extent_m)
    region = sphere if view.mask is None else region_of_mask(view.mask)  # a silhouette says better where the object is
    found = [asdict(fault) for fault in faults(view, region)]
    return {"world_from_camera": view.camera.world_from_camera.tolist(), "faults": found}
