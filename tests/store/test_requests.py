"""A repeated request is answered as before and does nothing twice, also where the first answer was lost."""

from __future__ import annotations

from collections.abc import Callable
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest

from core.encode import EncodedBurst
from core.errors import Conflict
from core.reference import Reference
from core.scan import ScanRequest
from core.sim3 import Sim3
from core.views import Burst
from store.memory import Memory
from store.records import Category
from store.requests import Reply, unnoted
from store.retention import Retention
from tests.store.conftest import NOVEL

DONE = Reply(201, "application/json", b"{}")


def test_the_same_key_gets_the_same_answer(memory: Memory) -> None:
    with memory.requests.once("k", "/v1/scans", "d") as once:
        assert once.earlier is None
        once.reply = DONE
    with memory.requests.once("k", "/v1/scans", "d") as again:
        assert again.earlier.reply == DONE


def test_answers_survive_a_restart(folder: Path) -> None:
    with Memory.open(folder) as memory, memory.requests.once("k", "r", "d") as once:
        once.reply = DONE
    with Memory.open(folder) as memory, memory.requests.once("k", "r", "d") as again:
        assert again.earlier.reply == DONE


def test_a_change_without_an_answer_is_known_by_what_it_made(folder: Path, request_for_views: ScanRequest) -> None:
    with Memory.open(folder) as memory, memory.requests.once("k", "r", "d"):
        scan = memory.scans.create(request_for_views)
    with Memory.open(folder) as memory, memory.requests.once("k", "r", "d") as again:
        assert (again.earlier.reply, again.earlier.result_id) == (None, scan.id)


def test_a_request_that_ended_before_what_it_is_for_is_begun_anew_once(folder: Path, request_for_views: ScanRequest) -> None:
    with Memory.open(folder) as memory, memory.requests.once("k", "r", "d"), unnoted():
        memory.scans.create(request_for_views)
    with Memory.open(folder) as memory:
        with memory.requests.once("k", "r", "d") as anew:
            assert anew.earlier is None
            anew.reply = DONE
        with memory.requests.once("k", "r", "d") as again:
            assert again.earlier.reply == DONE


def test_what_a_request_is_for_is_known_by_its_id_whatever_came_before_it(memory: Memory, request_for_views: ScanRequest) -> None:
    with memory.requests.once("k", "r", "d"):
        with unnoted():
            memory.scans.create(request_for_views)
        scan = memory.scans.create(request_for_views)
    with memory.requests.once("k", "r", "d") as again:
        assert again.earlier.result_id == scan.id


def test_work_that_failed_may_be_tried_again(memory: Memory) -> None:
    with pytest.raises(RuntimeError), memory.requests.once("k", "r", "d"):
        raise RuntimeError
    with memory.requests.once("k", "r", "d") as again:
        assert again.earlier is None


def test_a_failed_change_is_not_taken_for_done(memory: Memory, request_for_views: ScanRequest) -> None:
    with pytest.raises(Conflict), memory.requests.once("k", "r", "d"):
        memory.scans.create(request_for_views, "no such observation")
    with memory.requests.once("k", "r", "d") as again:
        assert again.earlier is None


def test_a_key_is_for_one_body(memory: Memory) -> None:
    with memory.requests.once("k", "r", "d") as once:
        once.reply = DONE
    with pytest.raises(Conflict, match="another request"), memory.requests.once("k", "r", "other"):
        pass
    with memory.requests.once("k", "other route", "other") as elsewhere:
        assert elsewhere.earlier is None


def test_a_repetition_during_the_first_waits(memory: Memory) -> None:
    with memory.requests.once("k", "r", "d"):
        with pytest.raises(Conflict, match="still being answered"), memory.requests.once("k", "r", "d"):
            pass
        with memory.requests.once("another", "r", "d") as other:
            assert other.earlier is None


def test_what_is_done_outside_is_not_counted(memory: Memory, request_for_views: ScanRequest) -> None:
    with memory.requests.once("k", "r", "d"):
        pass
    memory.scans.create(request_for_views)
    with memory.requests.once("k", "r", "d") as again:
        assert again.earlier is None


def test_keys_end(folder: Path) -> None:
    with Memory.open(folder, Retention(requests=timedelta(0))) as memory:
        with memory.requests.once("k", "r", "d") as once:
            once.reply = DONE
        with memory.requests.once("k", "r", "other") as again:
            assert again.earlier is None
        memory.prune()
        assert memory._connection.rows("SELECT key FROM requests") == []


def test_keeping_a_key_is_no_change_to_read(memory: Memory) -> None:
    before = memory.version
    with memory.requests.once("k", "r", "d") as once:
        once.reply = DONE
    assert memory.version == before


def noted(memory: Memory, change: Callable[[], object]) -> str:
    """What a repeated request would be told that this change made."""
    with memory.requests.once("k", "r", "d"):
        change()
    (row,) = memory._connection.rows("SELECT result_id FROM requests")
    return row["result_id"]


CHANGES: dict[str, Callable[[Memory, str, str], object]] = {
    "rename": lambda memory, this, other: memory.categories.rename(this, "x"),
    "delete": lambda memory, this, other: memory.categories.delete(this),
    "merge": lambda memory, this, other: memory.categories.merge(other, this),
}


@pytest.mark.parametrize("kind", CHANGES)
def test_of_a_changed_category_that_category_is_noted(kind: str, memory: Memory, category: Category, other: Category) -> None:
    assert noted(memory, lambda: CHANGES[kind](memory, category.id, other.id)) == category.id


def test_of_a_split_the_new_category_is_noted(
    memory: Memory, category: Category, other: Category, reference: Reference, burst: Burst
) -> None:
    memory.categories.merge(category.id, other.id)
    moved = memory.instances.of(other.id)[0].id
    made = noted(memory, lambda: memory.categories.split(other.id, [moved], reference, burst))
    assert memory.instances.get(moved).category_id == made


def test_of_an_undoing_its_entry_is_noted(memory: Memory, category: Category) -> None:
    memory.categories.rename(category.id, "x")
    renamed = memory.audit.latest(1)[0].id
    assert noted(memory, lambda: memory.undo(renamed)) == memory.audit.get(renamed).undone_by


def test_of_an_import_its_entry_is_noted(second: Memory, archive: Path) -> None:
    assert noted(second, lambda: second.import_archive(archive)) == second.audit.latest(1)[0].id


def test_of_a_deleted_goal_that_goal_is_noted(memory: Memory, category: Category) -> None:
    goal = memory.goals.create(category.id, None, Sim3.identity()).id
    assert noted(memory, lambda: memory.goals.delete(goal)) == goal


def test_of_a_deleted_scan_that_scan_is_noted(memory: Memory, request_for_views: ScanRequest) -> None:
    scan = memory.scans.create(request_for_views).id
    assert noted(memory, lambda: memory.scans.delete(scan)) == scan


def test_of_a_correction_the_observation_is_noted(memory: Memory, category: Category, burst: Burst, encoded: EncodedBurst) -> None:
    seen = memory.observations.create(NOVEL, burst, {"a": np.arange(3)}).id
    assert noted(memory, lambda: memory.corrections.to_category(seen, category.id, encoded)) == seen


def test_of_a_correction_to_a_new_category_the_observation_is_noted(
    memory: Memory, reference: Reference, burst: Burst, encoded: EncodedBurst
) -> None:
    seen = memory.observations.create(NOVEL, burst, {"a": np.arange(3)}).id
    assert noted(memory, lambda: memory.corrections.to_new(seen, reference, burst, encoded)) == seen
