"""What the database refuses, and what is refused before it is asked."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from core.errors import Conflict, Unavailable
from store.connection import Connection, before_change
from store.memory import Memory
from store.records import Category


def test_a_database_that_cannot_be_opened_is_told_with_the_remedy(tmp_path: Path) -> None:
    with pytest.raises(Unavailable, match="cannot open the memory in .*set ONELOOK_DATA_DIR"):
        Connection(tmp_path / "no such folder")


def test_a_database_that_does_not_answer_is_told_with_the_remedy(tmp_path: Path) -> None:
    connection = Connection(tmp_path)
    connection.close()
    with pytest.raises(Unavailable, match="does not answer.*check its disk"):
        connection.rows("SELECT 1")


def test_wrong_sql_is_not_taken_for_a_disk_that_fails(memory: Memory) -> None:
    with pytest.raises(sqlite3.ProgrammingError), memory._connection.housekeeping() as db:
        db.execute("SELECT ?", [])
    memory.require_sound()


def test_what_is_not_wanted_any_more_is_refused_before_anything_is_written(memory: Memory, category: Category) -> None:
    def unwanted() -> None:
        raise Conflict("nobody waits for this")

    version = memory.version
    token = before_change.set(unwanted)
    try:
        with pytest.raises(Conflict, match="nobody waits for this"):
            memory.categories.rename(category.id, "mug")
    finally:
        before_change.reset(token)
    assert (memory.version, memory.categories.get(category.id).name) == (version, "cup")


def test_one_row_is_the_first(memory: Memory, category: Category, other: Category) -> None:
    row = memory._connection.row("SELECT name FROM categories ORDER BY rowid DESC")
    assert row == {"name": "mug"}


def test_where_there_is_no_row_none_is_given(memory: Memory) -> None:
    assert memory._connection.row("SELECT name FROM categories") is None
