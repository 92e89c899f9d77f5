"""A repeated request is answered as before and does nothing twice, also where the first answer was lost."""

from __future__ import annotations

from datetime import timedelta
from pathlib import Path

import pytest

from core.errors import Conflict
from core.scan import ScanRequest
from store.memory import Memory
from store.requests import Reply
from store.retention import Retention

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
