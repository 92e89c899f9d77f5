"""Opening, closing and identity of a memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from core.encode import EncodedBurst
from core.errors import Conflict, InvalidInput, Unavailable
from core.reference import Reference
from core.scan import ScanRequest
from core.views import Burst
from store.memory import Memory
from store.retention import Retention
from tests.store.conftest import NOVEL


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


@pytest.mark.parametrize("where", [0.02, 0.3, 0.6, 0.9])
def test_a_torn_database_is_one_sentence(folder: Path, reference: Reference, burst: Burst, encoded: EncodedBurst, where: float) -> None:
    with Memory.open(folder) as memory:
        memory.categories.create(reference, burst, encoded)
    database = folder / "memory.sqlite3"
    content = database.read_bytes()
    database.write_bytes(content[: int(where * len(content))])
    with pytest.raises(Unavailable, match="restore it from a backup"):
        Memory.open(folder)
    with pytest.raises(Unavailable, match="restore it from a backup"):
        Memory.reading(folder)


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


def test_limits_hold_after_they_were_lowered(folder: Path, burst: Burst) -> None:
    with Memory.open(folder) as memory:
        ids = [memory.observations.create(NOVEL, burst, {"a": np.arange(3)}).id for _ in range(3)]
    with Memory.open(folder, Retention(observations=1)) as memory:
        assert [each.id for each in memory.observations.latest(9)] == ids[2:]
        assert [path.name for path in memory.observations.root.iterdir()] == ids[2:]


def test_what_a_lower_limit_drops_is_a_change_and_opening_again_is_none(folder: Path, burst: Burst) -> None:
    with Memory.open(folder) as memory:
        for _ in range(2):
            memory.observations.create(NOVEL, burst, {"a": np.arange(3)})
        before = memory.version
    for _ in range(2):
        with Memory.open(folder, Retention(observations=1)) as memory:
            assert memory.version == before + 1


def test_whoever_does_not_know_the_limits_removes_nothing(folder: Path, burst: Burst) -> None:
    with Memory.open(folder, Retention(observations=2000)) as memory, memory._connection.change() as db:
        old = {"created_at": "2000-01-01", "outcome": "novel", "views": 1, "timings_ms": "{}", "features_sha256": "", "files": "{}"}
        db.table("observations").insert_all({"id": str(index)} | old for index in range(1500))
    with Memory.open(folder) as memory:
        assert memory.sizes().observations == 1500
    with Memory.open(folder, Retention()) as memory:
        assert memory.sizes().observations == 1000


def test_no_observation_at_all_is_refused() -> None:
    with pytest.raises(InvalidInput, match="^observations: found 0, expected at least 1"):
        Retention(observations=0)


def test_settings_survive(folder: Path) -> None:
    with Memory.open(folder) as memory:
        assert memory.setting("threshold") is None
        memory.keep_setting("threshold", {"pooled": 0.4})
        memory.keep_setting("threshold", {"pooled": 0.5})
    with Memory.open(folder) as memory:
        assert memory.setting("threshold") == {"pooled": 0.5}
