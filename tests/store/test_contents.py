"""What the folder of a row holds."""

from __future__ import annotations

import pytest

from core.errors import NotFound
from store.contents import FOLDERS, files_of
from store.folders import sums
from store.memory import Memory
from store.records import Category


def test_the_files_of_a_row_are_those_in_its_folder(full: Memory, category: Category) -> None:
    assert files_of(full._connection, f"categories/{category.id}") == sums(full.categories.folder(category.id))


def test_of_a_row_that_is_gone_they_are_not_told(memory: Memory) -> None:
    with pytest.raises(NotFound, match="observations/gone was removed"):
        files_of(memory._connection, "observations/gone")


@pytest.mark.parametrize("table", FOLDERS)
def test_every_folder_is_found_by_its_row(full: Memory, table: str) -> None:
    folders = [row["folder"] for row in full._connection.rows(FOLDERS[table])]
    assert folders
    assert all((full.folder / folder).is_dir() for folder in folders)
