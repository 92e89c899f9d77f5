"""Opening, closing and identity of a memory."""

from __future__ import annotations

from pathlib import Path

import pytest
from sqlite_utils import Database

from core.encode import EncodedBurst
from core.errors import Conflict, Unavailable
from core.reference import Reference
from core.scan import ScanRequest
from core.views import Burst
from store.memory import Memory
from store.schema import upgrade


def test_an_empty_memory_has_version_0_and_nothing_in_it(memory: Memory) -> None:
    assert memory.version == 0
    assert memory.categories.all() == []
    assert memory.observations.latest(10) == []


def test_the_version_grows_with_each_change(memory: Memory, request_for_views: ScanRequest) -> None:
    versions = [memory.version]
    scan = memory.scans.create(request_for_views)
    versions.append(memory.version)
    memory.scans.delete(scan.id)
    versions.append(memory.version)
    assert versions == [0, 1, 2]


def test_a_failed_change_leaves_the_version(memory: Memory) -> None:
    with pytest.raises(RuntimeError), memory._connection.change():
        raise RuntimeError
    assert memory.version == 0


def test_what_was_learnt_is_there_after_reopening(folder: Path, reference: Reference, burst: Burst, encoded: EncodedBurst) -> None:
    with Memory.open(folder) as memory:
        made = memory.categories.create(reference, burst, encoded, name="cup")
        version = memory.version
    with Memory.open(folder) as memory:
        assert [(each.id, each.name) for each in memory.categories.all()] == [(made.id, "cup")]
        assert memory.version == version


def test_a_second_process_is_refused(folder: Path, memory: Memory) -> None:
    with pytest.raises(Conflict, match="open in another process"):
        Memory.open(folder)


def test_the_first_backbone_ties_the_memory(memory: Memory) -> None:
    memory.require_backbone("dinov2-s14", "aaaa")
    memory.require_backbone("renamed", "aaaa")
    assert memory.fingerprint == "aaaa"


def test_another_backbone_is_refused_and_both_are_named(memory: Memory) -> None:
    memory.require_backbone("dinov2-s14", "aaaa")
    with pytest.raises(Conflict, match="dinov2-s14 .*aaaa.* dino-s8 .*bbbb"):
        memory.require_backbone("dino-s8", "bbbb")


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(Unavailable, match="ONELOOK_DATA_DIR"):
        Memory.open(tmp_path / "file" / "memory")


def test_a_file_that_is_no_database_is_named(folder: Path) -> None:
    folder.mkdir()
    (folder / "memory.sqlite3").write_bytes(b"not a database" * 100)
    with pytest.raises(Unavailable, match=r"memory\.sqlite3 is no usable database"):
        Memory.open(folder)


def test_a_memory_of_a_later_version_is_refused(folder: Path, memory: Memory) -> None:
    memory.close()
    with Database(folder / "memory.sqlite3") as db:
        db.table("_sqlite_migrations").insert({"migration_set": "onelook", "name": "m999_later", "applied_at": "2099"})
    with pytest.raises(Conflict, match="m999_later"):
        Memory.open(folder)


def test_upgrading_twice_changes_nothing() -> None:
    with Database(memory=True) as db:
        upgrade(db)
        before = db.schema
        upgrade(db)
        assert db.schema == before


def test_half_written_folders_are_removed_at_the_start(
    folder: Path, reference: Reference, burst: Burst, encoded: EncodedBurst, request_for_views: ScanRequest
) -> None:
    with Memory.open(folder) as memory:
        category = memory.categories.create(reference, burst, encoded)
        scan = memory.scans.create(request_for_views)
        memory.scans.add(scan.id, burst)
    orphans = [
        folder / "categories" / "gone",
        folder / "observations" / ".partial-x",
        folder / "scans" / "gone",
        folder / "scans" / scan.id / "gone",
    ]
    for orphan in orphans:
        orphan.mkdir(parents=True)
    with Memory.open(folder) as memory:
        assert not any(orphan.exists() for orphan in orphans)
        assert memory.categories.reference(category.id)
        assert memory.scans.get(scan.id).views == len(burst)
