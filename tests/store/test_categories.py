"""Categories appear in one step, answer what they were made of, and are forgotten whole."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from core.encode import EncodedBurst
from core.errors import Conflict, NotFound, Unavailable
from core.reference import Reference
from core.scan import ScanRequest
from core.views import Burst
from store.memory import Memory
from store.records import Category


def test_a_category_tells_what_it_is(category: Category) -> None:
    assert (category.name, category.views, category.instances, category.extent_m) == ("cup", 3, 1, (0.1, 0.2, 0.3))


def test_its_reference_comes_back(memory: Memory, category: Category, reference: Reference) -> None:
    found = memory.categories.reference(category.id)
    assert np.array_equal(found.cloud_m, reference.cloud_m)
    assert np.array_equal(found.views[2].points_m, reference.views[2].points_m)
    assert np.array_equal(found.box.extent_m, reference.box.extent_m)


def test_its_views_come_back(memory: Memory, category: Category, burst: Burst) -> None:
    assert np.array_equal(memory.categories.view(category.id, 1).rgb, burst.views[1].rgb)


@pytest.mark.parametrize("index", [-1, 3])
def test_a_view_it_does_not_have_is_refused(memory: Memory, category: Category, index: int) -> None:
    with pytest.raises(NotFound, match="views 0 to 2"):
        memory.categories.view(category.id, index)


def test_its_first_member_is_the_scan(memory: Memory, category: Category, encoded: EncodedBurst) -> None:
    (member,) = memory.instances.members()
    assert member.category_id == category.id
    assert np.array_equal(member.cls, encoded.cls)
    assert np.array_equal(member.pooled, encoded.pooled)


def test_a_category_is_renamed_and_unnamed(memory: Memory, category: Category) -> None:
    assert memory.categories.rename(category.id, "mug").name == "mug"
    assert memory.categories.rename(category.id, None).name is None


def test_a_deleted_category_is_gone(memory: Memory, category: Category) -> None:
    memory.categories.delete(category.id)
    assert memory.instances.members() == []
    with pytest.raises(NotFound):
        memory.categories.get(category.id)


@pytest.mark.parametrize("category_id", ["nope", "../categories", ""])
def test_an_unknown_id_is_refused(memory: Memory, category_id: str) -> None:
    for ask in (memory.categories.get, memory.categories.delete, memory.categories.reference):
        with pytest.raises(NotFound, match="no category has the id"):
            ask(category_id)


def test_a_damaged_reference_is_named(memory: Memory, category: Category) -> None:
    path = memory.categories.folder(category.id) / "reference.npz"
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(Unavailable, match=r"reference\.npz is damaged"):
        memory.categories.reference(category.id)


def test_no_row_means_no_folder(
    memory: Memory, reference: Reference, burst: Burst, encoded: EncodedBurst, request_for_views: ScanRequest
) -> None:
    scan = memory.scans.create(request_for_views)
    memory.scans.delete(scan.id)
    with pytest.raises(Conflict, match="deleted meanwhile"):
        memory.categories.create(reference, burst, encoded, scan_id=scan.id)
    assert memory.categories.all() == []
    assert list(memory.categories.root.iterdir()) == []


def test_a_full_disk_is_told_and_leaves_nothing(
    memory: Memory, reference: Reference, burst: Burst, encoded: EncodedBurst, monkeypatch: pytest.MonkeyPatch
) -> None:
    def write_bytes(path: Path, content: bytes) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", write_bytes)
    with pytest.raises(Unavailable, match="No space left"):
        memory.categories.create(reference, burst, encoded)
    assert memory.categories.all() == []
    assert list(memory.categories.root.iterdir()) == []


def test_two_categories_keep_their_order(
    memory: Memory, category: Category, reference: Reference, burst: Burst, encoded: EncodedBurst
) -> None:
    second = memory.categories.create(reference, burst, encoded)
    assert [each.id for each in memory.categories.all()] == [category.id, second.id]


def test_names_are_those_of_living_categories(memory: Memory, category: Category, other: Category) -> None:
    assert memory.categories.names() == {category.id: "cup", other.id: "mug"}
    memory.categories.rename(other.id, None)
    memory.categories.delete(category.id)
    assert memory.categories.names() == {other.id: None}


def test_all_its_views_come_back_as_one_burst(memory: Memory, category: Category, burst: Burst) -> None:
    found = memory.categories.burst(category.id)
    assert [np.array_equal(mine.rgb, theirs.rgb) for mine, theirs in zip(found.views, burst.views, strict=True)] == [True] * 3


def test_its_first_view_is_0(memory: Memory, category: Category, burst: Burst) -> None:
    assert np.array_equal(memory.categories.view(category.id, 0).rgb, burst.views[0].rgb)


def test_one_is_summarised_as_its_page_does(memory: Memory, category: Category, other: Category) -> None:
    assert memory.categories.summary(other.id) == memory.categories.listing(9).categories[1]
    with pytest.raises(NotFound):
        memory.categories.summary("nope")
