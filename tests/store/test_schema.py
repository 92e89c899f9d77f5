"""A memory opens with every schema that was released, and keeps what it knows."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sqlite_utils import Database

from core.encode import EncodedBurst
from core.errors import Conflict, Unavailable
from core.evidence import part_tokens
from core.novelty import Decision
from core.reference import Reference
from core.views import Burst
from store.columns import files_from_json
from store.contents import FOLDERS
from store.folders import FileSum, sums
from store.memory import Memory
from store.records import Category
from store.schema import upgrade

from .conftest import DIM, NOVEL, VIEWS


@pytest.fixture
def first_version(folder: Path) -> Path:
    """Written by the first version: a category made of a scan and joined by an observation, and a scan in progress."""
    shutil.unpack_archive(Path(__file__).parents[1] / "data" / "memory_m001.zip", folder)
    return folder


@pytest.fixture
def upgraded(first_version: Path) -> Iterator[Memory]:
    """The same, opened."""
    with Memory.open(first_version) as memory:
        yield memory


@pytest.fixture
def cup(upgraded: Memory) -> Category:
    """Its category."""
    (category,) = upgraded.categories.all()
    return category


def test_what_was_learnt_is_still_known(upgraded: Memory, cup: Category, reference: Reference, encoded: EncodedBurst) -> None:
    assert (upgraded.backbone, cup.name, cup.instances, cup.origin_id) == ("dinov2-s14", "cup", 2, cup.id)
    found = upgraded.categories.reference(cup.id)
    assert np.array_equal(found.cloud_m, reference.cloud_m)
    assert np.array_equal(found.views[1].points_m, reference.views[1].points_m)
    for member in upgraded.instances.members():
        assert np.array_equal(member.cls, encoded.cls)
        assert np.array_equal(member.pooled, encoded.pooled)


def test_tokens_that_decisions_compare_now_are_made_of_its_arrays(upgraded: Memory, encoded: EncodedBurst) -> None:
    by_scan, by_observation = (each.id for each in upgraded.instances.listed())
    assert list(upgraded.instances.pooled_means([by_scan, by_observation])) == [by_scan]  # the other's features were no burst's
    assert np.array_equal(upgraded.instances.parts([by_scan])[by_scan], part_tokens(encoded))
    assert upgraded.check().ok


def test_patches_that_were_drawn_at_random_become_parts(full: Memory, encoded: EncodedBurst) -> None:
    """A memory of the version before parts: what was damaged by then is told as before."""
    axes = np.eye(12, DIM * 2)[:, :DIM] + np.eye(12, DIM * 2)[:, DIM:]  # four of them are there twice
    drawn = np.stack([np.repeat(axes, 2, axis=0)] * VIEWS).astype(np.float16)
    cup, mug = full.instances.listed()
    before_parts(full, encoded, {cup.id: drawn.tobytes()})
    with Memory.open(full.folder) as memory:
        (parts,) = memory.instances.parts([cup.id, mug.id]).values()
        assert parts.shape == (VIEWS, 12, DIM)
        assert {tuple(part) for part in parts[1].tolist()} == {tuple(axis) for axis in np.eye(DIM).tolist()}
        assert [damage.id for damage in memory.check().damages] == [mug.id]


@pytest.mark.parametrize("patches", [b"", np.full((VIEWS, 24, DIM), np.nan, np.float16).tobytes(), b"12"])
def test_where_patches_are_not_sound_parts_are_made_of_the_burst_s_arrays(full: Memory, encoded: EncodedBurst, patches: bytes) -> None:
    cup, _ = full.instances.listed()
    before_parts(full, encoded, {cup.id: patches})
    with Memory.open(full.folder) as memory:
        assert np.array_equal(memory.instances.parts([cup.id])[cup.id], part_tokens(encoded))


def test_what_decisions_found_before_parts_is_no_sample_any_more(full: Memory, encoded: EncodedBurst) -> None:
    cup, mug = full.instances.listed()
    found = ((cup.category_id, 0.5), (mug.category_id, 0.2))
    judged = replace(NOVEL, decision=Decision("novel", "best", float("inf"), found, rival=0.2))
    seen = full.observations.create(judged, full.instances.burst(cup.id), {"a": np.zeros(1)})
    before_parts(full, encoded, {})
    with Memory.open(full.folder) as memory:
        (decision,) = memory.observations.decisions(9)
        assert (decision.score, decision.similarities) == ("best of patches", found)
        assert decision.corrected(cup.category_id).rival is None
        assert memory.observations.get(seen.id).decision == decision


def before_parts(memory: Memory, encoded: EncodedBurst, patches: dict[str, bytes]) -> None:
    """Closes a memory as the version before parts left it: with these patches, and damaged tokens of every other instance."""
    ids = [each.id for each in memory.instances.listed()]
    memory.close()
    tokens = encoded.cls.tobytes() + encoded.pooled.tobytes()
    with Database(memory.folder / "memory.sqlite3") as db:
        db.execute("ALTER TABLE instances RENAME COLUMN parts TO patches")
        db.execute("UPDATE instances SET tokens_sha256 = ?", ["0" * 64])
        for each in ids:
            if each in patches:
                sha256 = FileSum.of(tokens + patches[each]).sha256
                db.table("instances").update(each, {"patches": patches[each], "tokens_sha256": sha256})
        db.execute("DELETE FROM _sqlite_migrations WHERE name = 'm008_parts'")


def test_provenance_is_what_can_be_told(upgraded: Memory, cup: Category) -> None:
    scanned, seen = upgraded.instances.of(cup.id)
    assert (scanned.source, scanned.how, upgraded.scans.get(scanned.source_id).category_id) == ("scan", "scan", cup.id)
    assert (seen.source, seen.how, seen.source_id) == ("observation", "decision", upgraded.observations.latest(1)[0].id)


def test_the_views_behind_every_instance_are_found(upgraded: Memory, cup: Category, burst: Burst) -> None:
    for instance in upgraded.instances.of(cup.id):
        assert np.array_equal(upgraded.instances.burst(instance.id).views[2].rgb, burst.views[2].rgb)


def test_what_was_seen_and_answered_is_still_there(upgraded: Memory, cup: Category) -> None:
    (seen,) = upgraded.observations.latest(9)
    assert (seen.outcome, seen.category_id, seen.frame, seen.pose.inliers) == ("known", cup.id, "map", 10)
    assert seen.pose.target_from_reference.scale == 0.7
    assert upgraded.observations.features(seen.id)["a"].tolist() == [0, 1, 2]


def test_a_scan_in_progress_goes_on(upgraded: Memory, burst: Burst) -> None:
    (row,) = upgraded._connection.rows("SELECT id FROM scans WHERE state = 'collecting'")
    assert upgraded.scans.require_open(row["id"]).views == 3
    assert upgraded.scans.add(row["id"], burst).views == 6


def test_every_file_gets_a_checksum(upgraded: Memory) -> None:
    folders = [row for query in FOLDERS.values() for row in upgraded._connection.rows(query)]
    assert len(folders) == 3
    for row in folders:
        assert files_from_json(row["files"]) == sums(upgraded.folder / row["folder"])


def test_a_memory_of_a_later_version_is_refused(folder: Path, memory: Memory) -> None:
    memory.close()
    with Database(folder / "memory.sqlite3") as db:
        db.table("_sqlite_migrations").insert({"migration_set": "onelook", "name": "m999_later", "applied_at": "2099"})
    with pytest.raises(Conflict, match="m999_later"):
        Memory.open(folder)


def dump(database: Path) -> list[str]:
    """Every table and row, as SQL."""
    with Database(sqlite3.connect(f"file:{database}?mode=ro", uri=True)) as db:
        return list(db.conn.iterdump())


def test_rows_are_copied_before_they_are_upgraded(first_version: Path) -> None:
    before = dump(first_version / "memory.sqlite3")
    with Memory.open(first_version):
        pass
    (copy,) = first_version.glob("memory.sqlite3.before-*")
    assert copy.name == "memory.sqlite3.before-m002_years"
    assert dump(copy) == before != dump(first_version / "memory.sqlite3")


def test_the_copy_in_its_old_place_is_the_memory_of_before(first_version: Path) -> None:
    """Going back: what the earlier version had is in the copy, and the folders that it names are still there."""
    with Memory.open(first_version) as memory:
        learnt = [category.id for category in memory.categories.all()]
    shutil.copy(first_version / "memory.sqlite3.before-m002_years", first_version / "memory.sqlite3")
    for left in first_version.glob("memory.sqlite3-*"):
        left.unlink()
    with Memory.open(first_version) as memory:
        assert [category.id for category in memory.categories.all()] == learnt
        assert memory.check().ok


def test_a_new_memory_and_one_of_this_version_are_not_copied(folder: Path) -> None:
    for _ in range(2):
        with Memory.open(folder):
            pass
    assert list(folder.glob("*before*")) == []


def test_one_of_an_earlier_version_is_upgraded_before_it_is_only_read(first_version: Path) -> None:
    with Memory.reading(first_version) as memory:
        (cup,) = memory.categories.all()
        assert memory.instances.of(cup.id)


def test_without_room_for_the_copy_nothing_is_upgraded(first_version: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = dump(first_version / "memory.sqlite3")

    def full(path: Path) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as broken:
        broken.setattr("store.schema.sync", full)
        with pytest.raises(Unavailable, match="free space"):
            Memory.open(first_version)
    assert dump(first_version / "memory.sqlite3") == before
    assert [path.name for path in first_version.iterdir() if "before" in path.name] == []
    with Memory.open(first_version) as memory:
        assert memory.check().ok


def test_upgrading_twice_changes_nothing() -> None:
    with Database(memory=True) as db:
        upgrade(db)
        before = db.schema
        upgrade(db)
        assert db.schema == before
