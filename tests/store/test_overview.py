"""Categories a page at a time, with what was seen of each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core.encode import EncodedBurst
from core.reference import Reference
from core.views import Burst
from store.memory import Memory
from store.observations import Joins
from store.records import Category
from tests.store.conftest import KNOWN


@pytest.fixture
def shelf(memory: Memory, category: Category, other: Category, reference: Reference, burst: Burst, encoded: EncodedBurst) -> Memory:
    """Learnt in this order: cup, mug, Bowl, one without a name. The mug was recognised twice, once with a pose and once without."""
    for name in ("Bowl", None):
        memory.categories.create(reference, burst, encoded, name=name)
    seen = replace(KNOWN, category_id=other.id)
    memory.observations.create(seen, burst, {"a": np.arange(3)}, joins=Joins(other.id, encoded, 0.9, "decision"))
    memory.observations.create(replace(seen, pose_error="too few"), burst, {"a": np.arange(3)})
    return memory


@pytest.mark.parametrize(
    ("order", "names"),
    [
        ("name", ["Bowl", "cup", "mug", None]),
        ("seen", ["mug", None, "Bowl", "cup"]),
        ("learnt", [None, "Bowl", "mug", "cup"]),
        ("instances", ["mug", "cup", "Bowl", None]),
    ],
)
def test_a_page_is_in_the_order_asked_for(shelf: Memory, order: str, names: list[str | None]) -> None:
    with shelf._connection.housekeeping() as db:  # else all is of the same millisecond
        db.execute("UPDATE categories SET created_at = '2026-01-01T00:00:00.000+00:00'")
    assert [each.name for each in shelf.categories.listing(9, order=order).categories] == names


def test_by_name_is_the_usual_order(shelf: Memory) -> None:
    assert shelf.categories.listing(1).categories[0].name == "Bowl"


def test_pages_follow_each_other_and_tell_how_many_there_are(shelf: Memory) -> None:
    pages = [shelf.categories.listing(3, offset) for offset in (0, 3)]
    assert [[each.name for each in page.categories] for page in pages] == [["Bowl", "cup", "mug"], [None]]
    assert [page.total for page in pages] == [4, 4]


@pytest.mark.parametrize(("called", "names"), [("U", ["cup", "mug"]), ("bowl", ["Bowl"]), ("nothing", [])])
def test_those_that_are_called_so(shelf: Memory, called: str, names: list[str]) -> None:
    page = shelf.categories.listing(1, called=called)
    assert ([each.name for each in page.categories], page.total) == (names[:1], len(names))


def test_the_beginning_of_an_id_names_one_too(shelf: Memory) -> None:
    nameless = next(each for each in shelf.categories.all() if each.name is None)
    assert [each.id for each in shelf.categories.listing(9, called=nameless.id[:12]).categories] == [nameless.id]
    assert shelf.categories.listing(9, called=nameless.id[1:]).total == 0


def test_what_was_seen_of_one_is_told(shelf: Memory, other: Category) -> None:
    latest = shelf.observations.latest(1)[0].created_at
    (mug,) = shelf.categories.listing(1, called="mug").categories
    assert (mug.id, mug.name, mug.created_at, mug.views) == (other.id, "mug", other.created_at, 3)
    assert (mug.instances, mug.recognised, mug.without_pose, mug.last_seen) == (2, 2, 1, latest)


def test_one_that_was_never_seen_again_was_seen_when_it_was_learnt(shelf: Memory, category: Category) -> None:
    (cup,) = shelf.categories.listing(1, called="cup").categories
    assert (cup.recognised, cup.without_pose, cup.last_seen) == (0, 0, category.created_at)


def test_a_summary_is_of_the_id_whatever_others_are_called(shelf: Memory, category: Category) -> None:
    nameless = next(each for each in shelf.categories.all() if each.name is None)
    shelf.categories.rename(category.id, nameless.id)
    assert shelf.categories.summary(nameless.id).id == nameless.id


def test_what_is_deleted_is_on_no_page(shelf: Memory, other: Category) -> None:
    shelf.categories.delete(other.id)
    assert [each.name for each in shelf.categories.listing(9).categories] == ["Bowl", "cup", None]
