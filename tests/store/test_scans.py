"""Scans keep what they asked for and what came, and end in a category."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest

from core.encode import EncodedBurst
from core.errors import Conflict, NotFound
from core.reference import Reference
from core.scan import ScanRequest
from core.views import Burst
from store.connection import before_change
from store.memory import Memory
from store.retention import Retention


@pytest.fixture
def completed(memory: Memory, request_for_views: ScanRequest, reference: Reference, burst: Burst, encoded: EncodedBurst) -> str:
    """The id of a scan that became a category."""
    scan = memory.scans.create(request_for_views)
    memory.categories.create(reference, burst, encoded, scan_id=scan.id)
    return scan.id


def test_a_scan_keeps_its_request(memory: Memory, request_for_views: ScanRequest) -> None:
    scan = memory.scans.create(request_for_views)
    assert (scan.state, scan.views) == ("requested", 0)
    assert np.array_equal(scan.request.world_from_camera, request_for_views.world_from_camera)
    assert scan.request.radius_m == request_for_views.radius_m


def test_views_add_up_in_order(memory: Memory, request_for_views: ScanRequest, burst: Burst) -> None:
    scan = memory.scans.create(request_for_views)
    memory.scans.add(scan.id, burst.select([2]))
    assert memory.scans.add(scan.id, burst.select([0, 1])).views == 3
    found = memory.scans.burst(scan.id)
    assert [np.array_equal(view.rgb, burst.views[index].rgb) for view, index in zip(found.views, (2, 0, 1))] == [True] * 3


def test_a_scan_without_views_has_no_burst(memory: Memory, request_for_views: ScanRequest) -> None:
    assert memory.scans.burst(memory.scans.create(request_for_views).id) is None


def test_a_scan_outlives_the_process(folder: Path, request_for_views: ScanRequest, burst: Burst) -> None:
    with Memory.open(folder) as memory:
        scan = memory.scans.create(request_for_views)
        memory.scans.add(scan.id, burst)
    with Memory.open(folder) as memory:
        assert memory.scans.get(scan.id).state == "collecting"
        assert len(memory.scans.burst(scan.id)) == len(burst)


def test_completing_makes_one_category_and_frees_the_views(
    memory: Memory, request_for_views: ScanRequest, reference: Reference, burst: Burst, encoded: EncodedBurst
) -> None:
    scan = memory.scans.create(request_for_views)
    memory.scans.add(scan.id, burst)
    category = memory.categories.create(reference, burst, encoded, scan_id=scan.id)
    done = memory.scans.get(scan.id)
    assert (done.state, done.category_id, done.views) == ("completed", category.id, 0)
    assert not memory.scans.folder(scan.id).exists()
    with pytest.raises(Conflict):
        memory.categories.create(reference, burst, encoded, scan_id=scan.id)
    assert len(memory.categories.all()) == 1


def test_a_completed_scan_takes_no_more_views(memory: Memory, completed: str, burst: Burst) -> None:
    with pytest.raises(Conflict, match="completed"):
        memory.scans.add(completed, burst)


def test_deleting_forgets_rows_and_views(memory: Memory, request_for_views: ScanRequest, burst: Burst) -> None:
    scan = memory.scans.create(request_for_views)
    memory.scans.add(scan.id, burst)
    memory.scans.delete(scan.id)
    assert not memory.scans.folder(scan.id).exists()
    with pytest.raises(NotFound):
        memory.scans.get(scan.id)


def test_what_was_said_of_each_burst_comes_back_in_order(memory: Memory, request_for_views: ScanRequest, burst: Burst) -> None:
    scan = memory.scans.create(request_for_views)
    for report in ({"accepted": [0, 1]}, None):
        memory.scans.add(scan.id, burst, report)
    assert memory.scans.reports(scan.id) == [{"accepted": [0, 1]}, None]
    with pytest.raises(NotFound):
        memory.scans.reports("nope")


def test_a_scan_may_ask_for_other_viewpoints(memory: Memory, request_for_views: ScanRequest) -> None:
    scan = memory.scans.create(request_for_views)
    changed = memory.scans.replace_request(scan.id, replace(request_for_views, radius_m=0.5))
    assert (changed.id, changed.request.radius_m, changed.state) == (scan.id, 0.5, "requested")


def test_a_completed_scan_asks_for_nothing_more(memory: Memory, completed: str, request_for_views: ScanRequest) -> None:
    with pytest.raises(Conflict, match="completed"):
        memory.scans.replace_request(completed, request_for_views)


def test_an_expired_scan_takes_no_more_views(folder: Path, request_for_views: ScanRequest, burst: Burst) -> None:
    with Memory.open(folder, Retention(scans=timedelta(0))) as memory:
        scan = memory.scans.create(request_for_views)
        with pytest.raises(Conflict, match="since no views came; begin another"):
            memory.scans.add(scan.id, burst)


def test_a_scan_that_is_completed_while_others_expire_stays_completed(
    folder: Path, request_for_views: ScanRequest, reference: Reference, burst: Burst, encoded: EncodedBurst
) -> None:
    with Memory.open(folder, Retention(scans=timedelta(0))) as memory:
        scan = memory.scans.create(request_for_views)

        def complete() -> None:
            before_change.reset(token)
            memory.categories.create(reference, burst, encoded, scan_id=scan.id)

        token = before_change.set(complete)
        memory.scans.expire()
        assert memory.scans.get(scan.id).state == "completed"


def test_scans_are_counted_by_state(memory: Memory, request_for_views: ScanRequest, burst: Burst) -> None:
    _, begun, over = (memory.scans.create(request_for_views) for _ in range(3))
    memory.scans.add(begun.id, burst)
    with memory._connection.housekeeping() as db:
        db.execute("UPDATE scans SET expires_at = '2000-01-01' WHERE id = ?", [over.id])
    assert memory.scans.states() == {"requested": 1, "collecting": 1, "expired": 1}


def test_a_scan_whose_time_is_over_is_in_progress_nowhere(memory: Memory, request_for_views: ScanRequest) -> None:
    begun, over = (memory.scans.create(request_for_views) for _ in range(2))
    with memory._connection.housekeeping() as db:
        db.execute("UPDATE scans SET expires_at = '2000-01-01' WHERE id = ?", [over.id])
    assert [each.id for each in memory.scans.in_progress(9)] == [begun.id]
    assert memory.sizes().scans == 1
