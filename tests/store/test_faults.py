"""A disk that fails, is full or slow, a clock that jumps: what was acknowledged stays, nothing half done is visible, and it recovers."""

from __future__ import annotations

import errno
import threading
from collections.abc import Callable, Iterator
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from core.encode import EncodedBurst
from core.errors import Unavailable
from core.reference import Reference
from core.scan import ScanRequest
from core.views import Burst
from store import times
from store.connection import TRIAL
from store.contents import FOLDERS
from store.memory import Memory
from store.records import Category
from store.retention import Retention
from tests.faults import Disk, failing, tapped
from tests.store.conftest import NOVEL

LONG_S = 20


@pytest.fixture
def disk(folder: Path) -> Iterator[Disk]:
    """Before every call of the memory."""
    with tapped(Disk(folder)) as disk:
        yield disk


@pytest.fixture
def filled(disk: Disk, full: Memory) -> Memory:
    """A memory on that disk."""
    return full


@pytest.fixture
def changes(
    filled: Memory, category: Category, reference: Reference, burst: Burst, encoded: EncodedBurst, request_for_views: ScanRequest
) -> dict[str, Callable[[], object]]:
    """One of each kind."""
    (scan,) = filled.scans.in_progress(1)
    return {
        "learn": lambda: filled.categories.create(reference, burst, encoded, name="new", scan_id=scan.id),
        "observe": lambda: filled.observations.create(NOVEL, burst, {"a": np.arange(3)}),
        "add views": lambda: filled.scans.add(scan.id, burst),
        "rename": lambda: filled.categories.rename(category.id, "new"),
        "delete": lambda: filled.categories.delete(category.id),
        "begin": lambda: filled.scans.create(request_for_views),
    }


def state(memory: Memory) -> object:
    """All rows that a reader could see, and every file."""
    tables = {name: memory._connection.rows(f"SELECT * FROM {name}") for name in (*FOLDERS, "scans", "instances", "goals", "meta", "audit")}
    return tables, sorted(str(path) for path in memory.folder.rglob("*") if memory.folder / "memory.sqlite3" not in (path, path.parent))


@pytest.mark.parametrize("error", [errno.ENOSPC, errno.EIO])
@pytest.mark.parametrize("kind", ["write", "fsync", "mkdir", "rename", "begin", "commit"])
def test_what_cannot_be_written_is_refused_whole_and_can_be_done_later(disk, filled, changes, kind, error):
    before = state(filled)
    for name, change in changes.items():
        if kind not in {"begin", "commit"} and name in {"rename", "delete", "begin"}:
            continue  # rows only
        disk.arm(None)
        disk.fault = failing(error, kind)
        with pytest.raises(Unavailable, match="free space or set another ONELOOK_DATA_DIR"):
            change()
        assert kind in disk.kinds
        with pytest.raises(Unavailable, match=r"no space|full|[Ii]/O|Input/output|No space"):
            filled.require_sound()
        assert state(filled) == before, f"{name} left something behind"
        disk.fault = lambda kind, path: None
        filled.require_sound()
        assert state(filled) == before
    changes["learn"]()
    assert filled.check().ok
    assert state(filled) != before


def test_a_database_that_is_full_is_refused_whole_and_can_be_done_later(filled, changes, encoded):
    """SQLite's own report, not one made up for it."""
    before = state(filled)
    pages = filled._connection.rows("PRAGMA page_count")[0]["page_count"]
    filled._connection.rows(f"PRAGMA max_page_count = {pages}")
    refused = None
    while refused is None:
        try:
            changes["observe"]()
            before = state(filled)
        except Unavailable as error:
            refused = str(error)
    assert "full" in refused
    assert state(filled) == before
    filled._connection.rows("PRAGMA max_page_count = 1000000")
    filled.require_sound()
    changes["observe"]()
    assert filled.check().ok


def test_the_trial_of_a_disk_leaves_nothing(disk, filled, changes):
    disk.fault = failing(errno.ENOSPC, "write")
    with pytest.raises(Unavailable):
        changes["observe"]()
    disk.fault = lambda kind, path: None
    filled.require_sound()
    assert not (filled.folder / TRIAL).exists()
    disk.arm(None)
    filled.require_sound()
    assert disk.calls == 0, "a sound memory is not written to"


def test_a_start_on_a_full_disk_is_one_sentence_and_leaves_the_memory_whole(disk, filled):
    before = state(filled)
    filled.close()
    disk.fault = failing(errno.ENOSPC, "begin", "write", "mkdir")
    with pytest.raises(Unavailable, match="full; free space"):
        Memory.open(filled.folder)
    disk.fault = lambda kind, path: None
    with Memory.open(filled.folder) as again:
        assert state(again) == before
        assert again.check().ok


def test_a_slow_disk_makes_writers_wait_and_nobody_else(disk, filled, changes):
    slow, reached = threading.Event(), threading.Event()

    def wait(kind: str, path: Path) -> None:
        if kind == "fsync":
            reached.set()
            slow.wait(LONG_S)

    disk.fault = wait
    writer = threading.Thread(target=changes["observe"])
    writer.start()
    assert reached.wait(LONG_S)
    assert len(filled.observations.latest(9)) == 1
    assert len(filled.instances.members()) == 2
    filled.categories.rename(filled.categories.all()[0].id, "meanwhile")
    slow.set()
    writer.join()
    assert len(filled.observations.latest(9)) == 2
    assert filled.check().ok


def test_every_commit_is_on_the_disk_before_it_is_acknowledged(filled):
    """SQLite syncs each of them itself; what the folders need is shown by the power cuts of test_random_crashes.py."""
    assert filled._connection.rows("PRAGMA synchronous")[0]["synchronous"] == 2
    assert filled._connection.rows("PRAGMA journal_mode")[0]["journal_mode"] == "wal"


@pytest.mark.parametrize("jump", [timedelta(days=3650), timedelta(days=-3650)])
def test_a_clock_that_jumps_takes_nothing_that_was_learnt(filled, changes, monkeypatch, jump):
    scan = filled.scans.in_progress(1)[0]
    changes["observe"]()
    known = [(each.id, each.name, each.instances) for each in filled.categories.all()]
    seen = [each.id for each in filled.observations.latest(9)]

    class Jumped(datetime):
        @classmethod
        def now(cls, tz=None):
            return datetime.now(tz) + jump

    monkeypatch.setattr(times, "datetime", Jumped)
    changes["begin"]()
    filled.prune()
    assert [(each.id, each.name, each.instances) for each in filled.categories.all()] == known
    assert [each.id for each in filled.observations.latest(9)] == seen
    assert len(filled.instances.members()) == 2
    assert filled.scans.get(scan.id).state == ("expired" if jump > timedelta(0) else "collecting")
    changes["observe"]()
    monkeypatch.undo()
    assert [each.id for each in filled.observations.latest(9)][1:] == seen, "the order is that of keeping, not of the clock"
    filled.prune()
    assert filled.check().ok


def test_a_disk_that_fails_while_old_things_are_removed_is_tidied_up_later(disk, filled, changes, burst):
    gone = filled.observations.root / filled.observations.latest(1)[0].id
    disk.fault = failing(errno.EIO, "remove")
    filled._connection.retention = Retention(observations=1)
    with pytest.raises(OSError, match="Input/output"):
        changes["observe"]()
    disk.fault = lambda kind, path: None
    assert gone.exists()
    filled.close()
    with Memory.open(filled.folder) as again:
        assert not gone.exists()
        assert again.check().ok
