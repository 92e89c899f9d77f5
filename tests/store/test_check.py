"""What is damaged is named, with what it stops; the rest goes on."""

from __future__ import annotations

import resource
from pathlib import Path

import pytest

from core.encode import EncodedBurst
from core.errors import Conflict, NotFound, Unavailable
from core.reference import Reference
from core.scan import ScanRequest
from core.views import Burst
from store import backup as backups
from store.connection import DATABASE
from store.memory import Memory
from store.records import Category

SMALL_BYTES = 40_000
"""More than a memory that is only read writes beside itself, less than its rows are."""


def flip(path: Path) -> None:
    """Changes one bit in the middle of a file."""
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def test_a_whole_memory_is_ok(full: Memory) -> None:
    told: list[tuple[int, int]] = []
    report = full.check(lambda done, total: told.append((done, total)))
    assert (report.ok, report.categories) == (True, 2)
    assert report.files == 2 * (3 * 3 + 2) + (3 * 3 + 2) + (3 * 3 + 1)
    assert told[-1] == (report.size, report.size)
    assert report.size == sum(path.stat().st_size for path in full.folder.rglob("*") if path.suffix in (".png", ".npz", ".json"))


@pytest.mark.parametrize("name", ["001_rgb.png", "001_depth.png", "001_mask.png", "cameras.json", "reference.npz"])
def test_one_bit_of_any_file_is_noticed(full: Memory, category: Category, name: str) -> None:
    flip(full.categories.folder(category.id) / name)
    (damage,) = full.check().damages
    assert (damage.kind, damage.id, damage.name, damage.file) == ("category", category.id, "cup", f"categories/{category.id}/{name}")
    assert damage.problem.startswith("has SHA-256 ")


def test_a_missing_and_a_short_file_are_told_apart(full: Memory, category: Category) -> None:
    folder = full.categories.folder(category.id)
    (folder / "000_rgb.png").unlink()
    (folder / "001_rgb.png").write_bytes(b"")
    missing, short = (each.problem for each in full.check().damages)
    assert "is missing" in missing
    assert "has 0 bytes" in short


def test_a_damaged_category_stops_neither_its_recognition_nor_the_others(full: Memory, category: Category, other: Category) -> None:
    flip(full.categories.folder(category.id) / "reference.npz")
    (damage,) = full.check().damages
    assert "no poses" in damage.consequence
    assert "recognised" in damage.consequence
    with pytest.raises(Unavailable):
        full.categories.reference(category.id)
    assert len(full.categories.reference(other.id).views) == 3
    assert {member.category_id for member in full.instances.members()} == {category.id, other.id}
    full.close()
    with Memory.open(full.folder) as again:
        assert len(again.categories.all()) == 2
        again.categories.delete(category.id)


def test_damaged_views_of_observations_and_scans_are_named_as_such(full: Memory) -> None:
    for kind in ("observations", "scans"):
        flip(next((full.folder / kind).rglob("000_rgb.png")))
    (seen,), (scan,) = full.observations.latest(1), full.scans.in_progress(1)
    assert {(damage.kind, damage.id) for damage in full.check().damages} == {("observation", seen.id), ("scan", scan.id)}


@pytest.mark.parametrize(
    ("place", "name", "words"),
    [
        (
            "categories",
            "reference.npz",
            "it gets no poses, but is recognised, and every other category works; restore, reembed or delete it",
        ),
        (
            "categories",
            "000_rgb.png",
            "this picture, and computing the category anew with another backbone; it is still recognised and has poses",
        ),
        ("observations", "000_rgb.png", "its pictures; nothing that was learnt, unless another backbone should compute it anew"),
        ("scans", "000_rgb.png", "this scan cannot become a category; delete it and begin another"),
    ],
)
def test_what_a_damage_costs_is_told(full: Memory, place: str, name: str, words: str) -> None:
    flip(next((full.folder / place).rglob(name)))
    (damage,) = full.check().damages
    assert damage.consequence == words
    assert (damage.name is None) == (place != "categories")


def test_what_a_damage_in_the_bin_costs_is_told(full: Memory, category: Category) -> None:
    full.categories.delete(category.id)
    flip(full.categories.folder(category.id) / "reference.npz")
    (damage,) = full.check().damages
    assert damage.consequence == "it is deleted or merged; undoing that brings it back damaged"


def test_damaged_tokens_are_named(full: Memory, category: Category) -> None:
    with full._connection.change() as db:
        db.execute("UPDATE instances SET pooled = zeroblob(length(pooled)) WHERE category_id = ?", [category.id])
    (damage,) = full.check().damages
    assert (damage.kind, damage.name) == ("instance", "cup")


def test_a_damaged_table_is_named(full: Memory) -> None:
    impossible = """UPDATE sqlite_schema SET sql = replace(sql, '"views" INTEGER', '"views" INTEGER CHECK (0)') WHERE name = 'instances'"""
    with full._connection.housekeeping() as db:
        db.execute("PRAGMA writable_schema = ON")
        db.execute(impossible)
        db.execute("PRAGMA writable_schema = RESET")
    assert {damage.kind for damage in full.check().damages} == {"database"}


def test_a_memory_is_checked_beside_the_process_that_has_it_open(full: Memory) -> None:
    with Memory.reading(full.folder) as reader:
        assert reader.check().ok
        assert reader.sizes() == full.sizes()
        with pytest.raises(Unavailable, match="readonly"):
            reader.categories.rename(reader.categories.all()[0].id, "x")
        full.categories.rename(full.categories.all()[0].id, "y")
        assert reader.categories.all()[0].name == "y"


def test_where_no_memory_is_none_is_made(folder: Path) -> None:
    with pytest.raises(NotFound, match="no memory is in"):
        Memory.reading(folder)
    assert not folder.exists()


def test_sizes_count_what_lives(full: Memory, category: Category, reference: Reference, encoded: EncodedBurst) -> None:
    full.categories.delete(category.id)
    found = full.sizes()
    assert (found.categories, found.instances, found.observations, found.scans, found.goals) == (1, 1, 1, 1, 0)
    assert found.size > full.check().size


def test_a_backup_is_a_memory(full: Memory, tmp_path: Path, category: Category) -> None:
    backup = full.backup(tmp_path / "backups" / "monday")
    report = full.check()
    assert (backup.files, backup.size, backup.damages) == (report.files, report.size, ())
    version = full.version
    full.categories.delete(category.id)
    with Memory.open(backup.folder) as copy:
        assert copy.version == version
        assert copy.check().ok
        assert [each.name for each in copy.categories.all()] == ["cup", "mug"]


def test_a_backup_tells_how_far_it_is(full: Memory, tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    backup = full.backup(tmp_path / "a", lambda done, total: told.append((done, total)))
    done = [each for each, _ in told]
    assert done == sorted(set(done))
    assert (done[0] > 1, told[-1]) == (True, (backup.size, backup.size))


def test_what_a_stopped_backup_left_is_in_nobodys_way(full: Memory, tmp_path: Path) -> None:
    (tmp_path / ".partial-a").mkdir()
    (tmp_path / ".partial-a" / "left").write_text("half")
    full.backup(tmp_path / "a")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "memory"]
    assert not (tmp_path / "a" / "left").exists()


def test_a_memory_that_is_never_at_rest_is_not_backed_up(
    full: Memory, tmp_path: Path, burst: Burst, request_for_views: ScanRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(backups, "ATTEMPTS", 2)

    def restless(done: int, total: int) -> None:
        for scan in full.scans.in_progress(9):
            full.scans.delete(scan.id)
        full.scans.add(full.scans.create(request_for_views).id, burst)

    with Memory.reading(full.folder) as reader, pytest.raises(Unavailable, match="faster than they are copied; back up later$"):
        reader.backup(tmp_path / "a", restless)
    assert [path.name for path in tmp_path.iterdir()] == ["memory"]


def test_a_backup_never_replaces_anything(full: Memory, tmp_path: Path) -> None:
    full.backup(tmp_path / "a")
    with pytest.raises(Conflict, match="exists"):
        full.backup(tmp_path / "a")


def test_a_backup_copes_with_what_is_removed_meanwhile(full: Memory, tmp_path: Path, burst: Burst, request_for_views: ScanRequest) -> None:
    scan = full.scans.create(request_for_views)
    full.scans.add(scan.id, burst)
    left = [scan.id]

    def remove_once(done: int, total: int) -> None:
        if left:
            full.scans.delete(left.pop())

    with Memory.reading(full.folder) as reader:
        backup = reader.backup(tmp_path / "a", remove_once)
    assert backup.damages == ()
    with Memory.open(backup.folder) as copy:
        assert copy.check().ok
        assert copy.sizes().scans == 1


def test_a_backup_names_what_was_damaged_before(full: Memory, tmp_path: Path, category: Category) -> None:
    (full.categories.folder(category.id) / "000_rgb.png").unlink()
    (damage,) = full.backup(tmp_path / "a").damages
    assert damage.file == f"categories/{category.id}/000_rgb.png"


def test_a_backup_that_cannot_be_written_leaves_nothing(full: Memory, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(Unavailable, match="choose another folder"):
        full.backup(tmp_path / "file" / "a")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "memory"]


def test_a_backup_of_a_damaged_database_says_so(full: Memory, tmp_path: Path) -> None:
    (page,) = next(iter(full._connection.rows("SELECT rootpage FROM sqlite_master WHERE name = 'categories'"))).values()
    (size,) = next(iter(full._connection.rows("PRAGMA page_size"))).values()
    list(full._connection.rows("PRAGMA wal_checkpoint(TRUNCATE)"))
    with (full.folder / DATABASE).open("r+b") as file:
        file.seek((page - 1) * size)
        file.write(bytes(range(256)) * (size // 256))
    with pytest.raises(Unavailable, match="is damaged: .*; restore it from a backup$"):
        full.backup(tmp_path / "a")


def test_a_backup_on_a_full_disk_is_told_with_the_remedy_and_leaves_nothing(full: Memory, tmp_path: Path) -> None:
    """SQLite's own report, not one made up for it."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (SMALL_BYTES, hard))
    try:
        with pytest.raises(Unavailable, match="^cannot back up to .*; free space, or choose another folder$"):
            full.backup(tmp_path / "a")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert [path.name for path in tmp_path.iterdir()] == ["memory"]
