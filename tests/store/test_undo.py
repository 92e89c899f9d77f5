"""The audit trail says who changed what, and takes it back."""

from __future__ import annotations

from datetime import timedelta
from pathlib import Path

import pytest

from core.encode import EncodedBurst
from core.errors import Conflict, NotFound
from core.reference import Reference
from core.sim3 import Sim3
from core.views import Burst
from store.memory import Memory
from store.records import Category
from store.retention import Retention
from tests.store.conftest import last


def test_a_change_says_who_and_what(memory: Memory, category: Category) -> None:
    memory.categories.rename(category.id, "mug", actor="anna")
    entry, created = memory.audit.latest(2)
    assert (entry.actor, entry.action, entry.category_id) == ("anna", "rename", category.id)
    assert (entry.before, entry.after) == ({"name": "cup"}, {"name": "mug"})
    assert entry.undoable
    assert (created.action, created.actor, created.undoable) == ("create", None, False)


def test_undoing_a_name_brings_the_earlier_one_back(memory: Memory, category: Category) -> None:
    memory.categories.rename(category.id, "mug")
    entry = last(memory)
    undone = memory.undo(entry.id, actor="anna")
    assert memory.categories.get(category.id).name == "cup"
    assert (undone.action, undone.actor, undone.before["entry"]) == ("undo", "anna", entry.id)
    assert memory.audit.get(entry.id).undone_by == undone.id


def test_undoing_a_deletion_brings_everything_back(memory: Memory, category: Category, reference: Reference) -> None:
    memory.goals.create(category.id, "shelf", Sim3.identity())
    memory.categories.delete(category.id)
    assert memory.instances.members() == []
    memory.undo(last(memory).id)
    assert memory.categories.get(category.id).name == "cup"
    assert len(memory.instances.members()) == 1
    assert [goal.name for goal in memory.goals.of(category.id)] == ["shelf"]
    assert memory.categories.reference(category.id).views[0].grid == reference.views[0].grid


def test_undoing_a_merge_gives_each_its_own(memory: Memory, category: Category, other: Category) -> None:
    memory.categories.merge(category.id, other.id)
    memory.undo(last(memory).id)
    assert [(each.id, each.instances) for each in memory.categories.all()] == [(category.id, 1), (other.id, 1)]


def test_undoing_a_split_loses_no_burst(memory: Memory, category: Category, other: Category, reference: Reference, burst: Burst) -> None:
    (mine,) = memory.instances.of(category.id)
    memory.categories.merge(category.id, other.id)
    part = memory.categories.split(other.id, [mine.id], reference, burst)
    memory.undo(last(memory).id)
    assert [(each.id, each.instances) for each in memory.categories.all()] == [(other.id, 2)]
    with pytest.raises(NotFound):
        memory.categories.get(part.id)


def test_undoing_a_forgotten_instance_brings_it_back(memory: Memory, category: Category, other: Category) -> None:
    memory.categories.merge(category.id, other.id)
    first = memory.instances.of(other.id)[0]
    memory.instances.forget(other.id, first.id)
    memory.undo(last(memory).id)
    assert memory.instances.get(first.id).category_id == other.id


def test_nothing_is_undone_twice(memory: Memory, category: Category) -> None:
    memory.categories.rename(category.id, "mug")
    entry = last(memory)
    memory.undo(entry.id)
    with pytest.raises(Conflict, match=f"^change '{entry.id}' cannot be undone: it is undone already$"):
        memory.undo(entry.id)
    with pytest.raises(Conflict, match="only rename, merge, split, delete, forget, correct can be, this is of the kind undo$"):
        memory.undo(last(memory).id)


def test_what_changed_since_is_not_overwritten(memory: Memory, category: Category, other: Category) -> None:
    memory.categories.rename(category.id, "beaker")
    first = last(memory)
    memory.categories.rename(category.id, "mug")
    version = memory.version
    with pytest.raises(Conflict, match="undo the later change first"):
        memory.undo(first.id)
    assert (memory.version, memory.categories.get(category.id).name) == (version, "mug")
    assert memory.audit.get(first.id).undone_by is None


def test_a_merge_into_what_was_merged_on_is_undone_last(
    memory: Memory, category: Category, other: Category, reference: Reference, burst: Burst, encoded: EncodedBurst
) -> None:
    third = memory.categories.create(reference, burst, encoded)
    memory.categories.merge(category.id, other.id)
    first = last(memory)
    memory.categories.merge(other.id, third.id)
    second = last(memory)
    with pytest.raises(Conflict, match="later change first"):
        memory.undo(first.id)
    memory.undo(second.id)
    memory.undo(first.id)
    assert [each.instances for each in memory.categories.all()] == [1, 1, 1]


def test_a_merge_whose_bursts_are_all_that_is_left_is_undone_last(memory: Memory, category: Category, other: Category) -> None:
    (own,) = memory.instances.of(other.id)
    memory.categories.merge(category.id, other.id)
    merged = last(memory)
    memory.instances.forget(other.id, own.id)
    forgotten = last(memory)
    with pytest.raises(Conflict, match="later change first"):
        memory.undo(merged.id)
    memory.undo(forgotten.id)
    memory.undo(merged.id)
    assert [each.instances for each in memory.categories.all()] == [1, 1]


def test_an_unknown_change_is_refused(memory: Memory) -> None:
    with pytest.raises(NotFound):
        memory.undo("nope")


def test_after_its_time_a_deletion_is_for_good(folder: Path, reference: Reference, burst: Burst, encoded: EncodedBurst) -> None:
    with Memory.open(folder, Retention(undo=timedelta(0))) as memory:
        category = memory.categories.create(reference, burst, encoded)
        memory.categories.delete(category.id)
        with pytest.raises(Conflict, match="older than"):
            memory.undo(last(memory).id)
        memory.prune()
        assert not memory.categories.folder(category.id).exists()
        assert memory._connection.rows("SELECT id FROM categories") == []
        assert memory._connection.rows("SELECT id FROM instances") == []


def test_the_views_of_a_merged_category_stay_as_long_as_its_burst(
    folder: Path, reference: Reference, burst: Burst, encoded: EncodedBurst
) -> None:
    with Memory.open(folder, Retention(undo=timedelta(0))) as memory:
        first, second = (memory.categories.create(reference, burst, encoded) for _ in range(2))
        (moved,) = memory.instances.of(first.id)
        memory.categories.merge(first.id, second.id)
        memory.prune()
        assert len(memory.instances.burst(moved.id)) == len(burst)
        memory.instances.forget(second.id, moved.id)
        memory.prune()
        assert not memory.categories.folder(first.id).exists()


def test_the_trail_is_read_a_page_at_a_time(memory: Memory, category: Category) -> None:
    for name in ("b", "c", "d"):
        memory.categories.rename(category.id, name)
    newest, older = memory.audit.latest(2)
    assert [entry.after["name"] for entry in memory.audit.latest(2, before=older.id)] == ["b", "cup"]
    assert memory.audit.latest(9)[0].id == newest.id
    assert newest.created_at >= older.created_at
    with pytest.raises(NotFound, match="^no change has the id 'nope'$"):
        memory.audit.latest(2, before="nope")


def test_the_trail_of_a_category_tells_what_came_from_others_and_went_to_them(
    memory: Memory, category: Category, other: Category, reference: Reference, burst: Burst
) -> None:
    memory.categories.merge(category.id, other.id)
    moved = memory.instances.of(other.id)[0]
    part = memory.categories.split(other.id, [moved.id], reference, burst)
    memory.categories.rename(part.id, "bowl")
    assert [entry.action for entry in memory.audit.of(other.id, 9)] == ["split", "merge", "create"]
    assert [entry.action for entry in memory.audit.of(part.id, 9)] == ["rename", "split"]
    assert [entry.action for entry in memory.audit.of(other.id, 1)] == ["split"]


def test_a_deletion_is_told_whole(memory: Memory, category: Category) -> None:
    memory.categories.delete(category.id, actor="anna")
    entry = last(memory)
    assert (entry.action, entry.category_id, entry.actor) == ("delete", category.id, "anna")
    assert (entry.before, entry.after) == ({"name": "cup", "instances": 1}, {})


def test_a_merge_is_told_whole(memory: Memory, category: Category, other: Category) -> None:
    (moved,) = memory.instances.of(category.id)
    memory.categories.merge(category.id, other.id, actor="anna")
    entry = last(memory)
    assert (entry.action, entry.category_id, entry.actor) == ("merge", category.id, "anna")
    assert (entry.before, entry.after) == ({"name": "cup", "instances": [moved.id]}, {"into": other.id})


def test_a_split_is_told_whole(memory: Memory, category: Category, other: Category, reference: Reference, burst: Burst) -> None:
    (mine,) = memory.instances.of(category.id)
    memory.categories.merge(category.id, other.id)
    part = memory.categories.split(other.id, [mine.id], reference, burst, name="bowl", actor="anna")
    entry = last(memory)
    assert (entry.action, entry.category_id, entry.actor) == ("split", other.id, "anna")
    assert (entry.before, entry.after) == ({"instances": [mine.id]}, {"category": part.id, "name": "bowl"})


def test_forgetting_an_instance_is_told_whole(memory: Memory, category: Category, other: Category) -> None:
    memory.categories.merge(category.id, other.id)
    first = memory.instances.of(other.id)[0]
    memory.instances.forget(other.id, first.id, actor="anna")
    entry = last(memory)
    assert (entry.action, entry.category_id, entry.actor) == ("forget", other.id, "anna")
    assert (entry.before, entry.after) == ({"instance": first.id}, {})


def test_an_undoing_is_told_whole(memory: Memory, category: Category) -> None:
    memory.categories.delete(category.id)
    deleted = last(memory)
    undone = memory.undo(deleted.id, actor="anna")
    assert (undone.action, undone.category_id, undone.actor) == ("undo", category.id, "anna")
    assert (undone.before, undone.after) == ({"entry": deleted.id, "action": "delete"}, {})


def test_an_errand_is_told_whole(memory: Memory) -> None:
    memory.note("backup", {"folder": "/var/backups"}, actor="anna")
    entry = last(memory)
    assert (entry.action, entry.category_id, entry.actor, entry.undoable) == ("backup", None, "anna", False)
    assert (entry.before, entry.after) == ({}, {"folder": "/var/backups"})
