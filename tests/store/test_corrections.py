"""What a person says an observation was of: its burst goes there, and comes back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core.encode import EncodedBurst
from core.errors import Conflict, NotFound
from core.reference import Reference
from core.views import Burst
from store.memory import Memory
from store.observations import Joins
from store.records import Category, Instance, Observation
from tests.store.conftest import KNOWN, NOVEL, last

FEATURES = {"a": np.arange(3)}


@pytest.fixture
def unassigned(memory: Memory, category: Category, burst: Burst) -> Observation:
    """Nobody said what it was of."""
    return memory.observations.create(NOVEL, burst, FEATURES)


@pytest.fixture
def assigned(memory: Memory, category: Category, burst: Burst, encoded: EncodedBurst) -> Observation:
    """Taken for the category."""
    joins = Joins(category.id, encoded, 0.9, "decision")
    return memory.observations.create(replace(KNOWN, category_id=category.id), burst, FEATURES, joins=joins)


def assignment(memory: Memory, seen: Observation) -> Instance | None:
    """Where its burst is."""
    everywhere = [each for category in memory.categories.all() for each in memory.instances.of(category.id)]
    return next((each for each in everywhere if each.source_id == seen.id), None)


def test_an_observation_of_nothing_joins_what_is_named(memory: Memory, category: Category, unassigned: Observation, encoded) -> None:
    memory.corrections.to_category(unassigned.id, category.id, encoded, actor="anna")
    instance = assignment(memory, unassigned)
    assert (instance.category_id, instance.source, instance.how, instance.similarity) == (category.id, "observation", "named", None)
    assert instance.pictures == f"observations/{unassigned.id}"
    assert memory.observations.get(unassigned.id).corrected_to == category.id


def test_a_wrong_assignment_moves(
    memory: Memory, category: Category, other: Category, assigned: Observation, encoded: EncodedBurst
) -> None:
    before = assignment(memory, assigned)
    memory.corrections.to_category(assigned.id, other.id, encoded)
    after = assignment(memory, assigned)
    assert (after.id, after.category_id, after.how, after.similarity) == (before.id, other.id, "named", None)
    assert memory.observations.get(assigned.id).corrected_to == other.id
    assert memory.audit.of(category.id, 1)[0].id == memory.audit.of(other.id, 1)[0].id == last(memory).id


def test_a_new_category_is_made_of_it(
    memory: Memory, category: Category, assigned: Observation, reference: Reference, burst: Burst, encoded: EncodedBurst
) -> None:
    made = memory.corrections.to_new(assigned.id, reference, burst, encoded, name="bowl", actor="anna")
    bowl = memory.categories.get(made)
    assert (bowl.name, bowl.views, bowl.instances) == ("bowl", 3, 1)
    assert assignment(memory, assigned).category_id == made
    assert np.array_equal(memory.categories.view(made, 1).rgb, burst.views[1].rgb)


def test_what_it_is_of_already_is_no_correction(memory: Memory, category: Category, assigned: Observation, encoded: EncodedBurst) -> None:
    with pytest.raises(Conflict, match=f"^observation '{assigned.id}' is one of category '{category.id}' already$"):
        memory.corrections.to_category(assigned.id, category.id, encoded)


def test_the_last_burst_of_a_category_does_not_leave(
    memory: Memory, category: Category, assigned: Observation, reference: Reference, burst: Burst, encoded: EncodedBurst
) -> None:
    made = memory.corrections.to_new(assigned.id, reference, burst, encoded)
    with pytest.raises(Conflict, match=f"^the burst is the last of category '{made}'; merge or delete that category instead$"):
        memory.corrections.to_category(assigned.id, category.id, encoded)
    assert assignment(memory, assigned).category_id == made


def test_a_category_that_is_gone_gets_nothing(memory: Memory, other: Category, assigned: Observation, encoded: EncodedBurst) -> None:
    memory.categories.delete(other.id)
    with pytest.raises(Conflict, match="deleted or merged meanwhile"):
        memory.corrections.to_category(assigned.id, other.id, encoded)


def test_an_observation_that_was_dropped_meanwhile_is_named(memory: Memory, category: Category, reference, burst, encoded) -> None:
    with pytest.raises(NotFound, match="^observation 'gone' was dropped meanwhile, as one of the oldest$"):
        memory.corrections.to_category("gone", category.id, encoded)
    with pytest.raises(NotFound, match="^observation 'gone' was dropped meanwhile, as one of the oldest$"):
        memory.corrections.to_new("gone", reference, burst, encoded)
    assert [path.name for path in memory.categories.root.iterdir()] == [category.id]


def test_the_trail_says_who_and_what(memory: Memory, category: Category, other: Category, assigned: Observation, encoded) -> None:
    before = assignment(memory, assigned)
    memory.corrections.to_category(assigned.id, other.id, encoded, actor="anna")
    entry = last(memory)
    assert (entry.action, entry.category_id, entry.actor, entry.undoable) == ("correct", other.id, "anna", True)
    was = {"id": before.id, "category_id": category.id, "how": "decision", "similarity": 0.9}
    assert entry.before == {"assigned": was, "corrected_to": None}
    assert entry.after == {"observation": assigned.id, "category": other.id, "instance": before.id, "made": False}


def test_the_trail_says_that_a_category_was_made(memory: Memory, unassigned: Observation, reference, burst, encoded) -> None:
    made = memory.corrections.to_new(unassigned.id, reference, burst, encoded, actor="anna")
    entry = last(memory)
    assert (entry.actor, entry.before["assigned"], entry.after["category"], entry.after["made"]) == ("anna", None, made, True)


def test_taken_back_a_moved_burst_is_as_it_was(memory: Memory, category: Category, other: Category, assigned: Observation, encoded) -> None:
    memory.corrections.to_category(assigned.id, other.id, encoded)
    memory.undo(last(memory).id)
    instance = assignment(memory, assigned)
    assert (instance.category_id, instance.how, instance.similarity) == (category.id, "decision", 0.9)
    assert memory.observations.get(assigned.id).corrected_to is None


def test_taken_back_a_burst_that_was_nowhere_is_nowhere(memory: Memory, category: Category, unassigned: Observation, encoded) -> None:
    memory.corrections.to_category(unassigned.id, category.id, encoded)
    memory.undo(last(memory).id)
    assert assignment(memory, unassigned) is None
    assert memory.categories.get(category.id).instances == 1


def test_taken_back_a_category_that_was_made_is_gone(
    memory: Memory, category: Category, assigned: Observation, reference, burst, encoded
) -> None:
    made = memory.corrections.to_new(assigned.id, reference, burst, encoded)
    memory.undo(last(memory).id)
    with pytest.raises(NotFound):
        memory.categories.get(made)
    assert assignment(memory, assigned).category_id == category.id


def test_a_second_correction_goes_back_to_the_first(memory: Memory, category: Category, other: Category, unassigned, encoded) -> None:
    memory.corrections.to_category(unassigned.id, category.id, encoded)
    memory.corrections.to_category(unassigned.id, other.id, encoded)
    memory.undo(last(memory).id)
    assert memory.observations.get(unassigned.id).corrected_to == category.id


def test_what_was_corrected_again_out_of_the_bin_stays_corrected(
    memory: Memory, category: Category, other: Category, unassigned, encoded
) -> None:
    memory.corrections.to_category(unassigned.id, category.id, encoded)
    first = last(memory)
    memory.categories.delete(category.id)
    memory.corrections.to_category(unassigned.id, other.id, encoded)
    memory.undo(first.id)
    assert memory.observations.get(unassigned.id).corrected_to == other.id
    assert assignment(memory, unassigned).category_id == other.id


def test_what_was_corrected_again_since_is_not_taken_back(memory: Memory, category: Category, other: Category, unassigned, encoded) -> None:
    memory.corrections.to_category(unassigned.id, category.id, encoded)
    first = last(memory)
    memory.corrections.to_category(unassigned.id, other.id, encoded)
    with pytest.raises(Conflict, match="undo the later change first"):
        memory.undo(first.id)
    assert assignment(memory, unassigned).category_id == other.id


def test_a_burst_does_not_go_back_to_a_category_that_is_gone(
    memory: Memory, category: Category, other: Category, assigned, encoded
) -> None:
    memory.corrections.to_category(assigned.id, other.id, encoded)
    corrected = last(memory)
    memory.categories.delete(category.id)
    with pytest.raises(Conflict, match="undo the later change first"):
        memory.undo(corrected.id)


def test_a_category_that_others_joined_since_is_not_taken_back(memory: Memory, unassigned, assigned, reference, burst, encoded) -> None:
    made = memory.corrections.to_new(unassigned.id, reference, burst, encoded)
    first = last(memory)
    memory.corrections.to_category(assigned.id, made, encoded)
    with pytest.raises(Conflict, match="undo the later change first"):
        memory.undo(first.id)
    assert memory.categories.get(made).instances == 2


def test_the_last_burst_of_a_category_is_not_taken_back_from_it(memory: Memory, category: Category, unassigned, encoded) -> None:
    (own,) = memory.instances.of(category.id)
    memory.corrections.to_category(unassigned.id, category.id, encoded)
    corrected = last(memory)
    memory.instances.forget(category.id, own.id)
    with pytest.raises(Conflict, match="undo the later change first"):
        memory.undo(corrected.id)
    assert memory.categories.get(category.id).instances == 1


def test_a_deletion_is_not_taken_back_while_its_burst_stands_elsewhere(
    memory: Memory, category: Category, other: Category, assigned: Observation, encoded
) -> None:
    memory.categories.delete(category.id)
    deleted = last(memory)
    memory.corrections.to_category(assigned.id, other.id, encoded)
    corrected = last(memory)
    with pytest.raises(Conflict, match=f"{assigned.id}' was corrected since, by change '{corrected.id}'; undo the later change first"):
        memory.undo(deleted.id)
    assert [each.id for each in memory.categories.all()] == [other.id]
    memory.undo(corrected.id)
    memory.undo(deleted.id)
    assert [each.instances for each in memory.categories.all()] == [2, 1]


def test_a_forgotten_burst_does_not_come_back_while_it_stands_elsewhere(
    memory: Memory, category: Category, other: Category, assigned: Observation, encoded
) -> None:
    memory.instances.forget(category.id, assignment(memory, assigned).id)
    forgotten = last(memory)
    memory.corrections.to_category(assigned.id, other.id, encoded)
    with pytest.raises(Conflict, match="undo the later change first"):
        memory.undo(forgotten.id)
    assert assignment(memory, assigned).category_id == other.id


def test_a_merge_is_not_taken_back_while_its_burst_stands_elsewhere(
    memory: Memory, category: Category, other: Category, assigned: Observation, reference, burst, encoded
) -> None:
    third = memory.categories.create(reference, burst, encoded)
    memory.categories.merge(category.id, third.id)
    merged = last(memory)
    memory.categories.delete(third.id)
    memory.corrections.to_category(assigned.id, other.id, encoded)
    with pytest.raises(Conflict, match="was corrected since, by change .*; undo the later change first"):
        memory.undo(merged.id)
    assert [each.id for each in memory.categories.all()] == [other.id]


def test_a_correction_out_of_the_bin_is_not_taken_back_while_its_burst_stands_elsewhere(
    memory: Memory, category: Category, other: Category, assigned: Observation, reference, burst, encoded
) -> None:
    third = memory.categories.create(reference, burst, encoded)
    memory.corrections.to_category(assigned.id, other.id, encoded)
    first = last(memory)
    memory.categories.delete(other.id)
    memory.corrections.to_category(assigned.id, third.id, encoded)
    with pytest.raises(Conflict, match="was corrected since, by change .*; undo the later change first"):
        memory.undo(first.id)
    assert assignment(memory, assigned).category_id == memory.observations.get(assigned.id).corrected_to == third.id


def test_what_was_imported_again_is_no_reason_to_keep_a_deletion(
    memory: Memory, category: Category, other: Category, assigned: Observation, encoded, tmp_path
) -> None:
    memory.require_backbone("colour", "fingerprint-a")
    path = memory.export(tmp_path / "cup.zip", [category.id]).path
    memory.categories.delete(category.id)
    deleted = last(memory)
    memory.import_archive(path)
    memory.categories.rename(other.id, "bowl")
    renamed = last(memory)
    memory.undo(deleted.id)
    memory.corrections.to_category(assigned.id, other.id, encoded)
    memory.undo(renamed.id)
    assert [each.name for each in memory.categories.all()] == ["cup", "mug", "cup"]


def test_an_imported_copy_comes_back_though_the_burst_itself_was_corrected_since(
    memory: Memory, category: Category, other: Category, assigned: Observation, encoded, tmp_path
) -> None:
    memory.require_backbone("colour", "fingerprint-a")
    path = memory.export(tmp_path / "cup.zip", [category.id]).path
    memory.categories.delete(category.id)
    first = last(memory)
    memory.import_archive(path)
    (copy,) = (each.id for each in memory.categories.all() if each.name == "cup")
    memory.undo(first.id)
    memory.categories.delete(copy)
    second = last(memory)
    memory.corrections.to_category(assigned.id, other.id, encoded)
    memory.undo(second.id)
    assert [each.name for each in memory.categories.all()].count("cup") == 2


def test_correcting_leaves_an_imported_copy_where_it_is(
    memory: Memory, category: Category, other: Category, assigned: Observation, encoded, tmp_path
) -> None:
    memory.require_backbone("colour", "fingerprint-a")
    path = memory.export(tmp_path / "cup.zip", [category.id]).path
    memory.categories.delete(category.id)
    memory.import_archive(path)
    memory.corrections.to_category(assigned.id, other.id, encoded)
    assert {each.name: memory.instances.of(each.id)[-1].source_id for each in memory.categories.all()} == {
        "mug": assigned.id,
        "cup": assigned.id,
    }
