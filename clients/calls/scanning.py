"""Scans."""

from __future__ import annotations

from collections.abc import Sequence

from clients.answers.categories import Category
from clients.answers.scans import ScanRequest
from clients.calls.call import Call, Direction, burst_body, burst_or_id, given, nothing, reading, reading_list
from core.views import Burst


def scan(
    source: Burst | str, *, viewpoints: int | None = None, up: Direction | None = None, standoff_m: float | None = None
) -> Call[ScanRequest]:
    """A scan of the object of a burst, or of an earlier observation by its id, whatever was decided then.

    Args:
        viewpoints: how many.
        up: away from the support, in the world frame; told from the cameras where None.
        standoff_m: distance of the viewpoints from the object; from its size and K where None.
    """
    params = given(viewpoints=viewpoints, up=None if up is None else list(up), standoff_m=standoff_m)
    return Call("POST", "/v1/scans", reading(ScanRequest.from_json), params, burst_or_id(source))


def scans(limit: int = 50) -> Call[list[ScanRequest]]:
    """Those in progress, the latest begun first."""
    return Call("GET", "/v1/scans", reading_list("scans", ScanRequest.from_json), {"limit": limit})


def open_scan(scan_id: str) -> Call[ScanRequest]:
    """A scan that was begun before."""
    return Call("GET", f"/v1/scans/{scan_id}", reading(ScanRequest.from_json))


def exclude_viewpoints(scan_id: str, viewpoints: Sequence[int]) -> Call[ScanRequest]:
    """Replaces viewpoints that the robot cannot reach, given by their places in the request, by other ones."""
    return Call("POST", f"/v1/scans/{scan_id}/exclude", reading(ScanRequest.from_json), body={"json": {"viewpoints": list(viewpoints)}})


def add_views(scan_id: str, burst: Burst) -> Call[ScanRequest]:
    """Sends views for a scan, one or several; their cameras say where they were really taken from, in the scan's world frame."""
    return Call("POST", f"/v1/scans/{scan_id}/views", reading(ScanRequest.from_json), body=burst_body(burst))


def complete_scan(scan_id: str, name: str | None = None) -> Call[Category]:
    """Makes the views of a scan a category, in one step."""
    return Call("POST", f"/v1/scans/{scan_id}/complete", reading(Category.from_json), body={"json": {"name": name}})


def forget_scan(scan_id: str) -> Call[None]:
    """Forgets a scan and its views; a category that it made stays."""
    return Call("DELETE", f"/v1/scans/{scan_id}", nothing)
