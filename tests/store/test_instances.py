"""Instances say where they came from, and can be forgotten one by one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from core.encode import EncodedBurst
from core.enrolled import ADAPTED_FROM, NEAREST
from core.errors import Conflict, InvalidInput, NotFound, Unavailable
from core.novelty import Decision, decide
from core.reference import Reference
from core.scan import ScanRequest
from core.views import Burst
from store import arrays, instances
from store.arrays import Array
from store.connection import Connection, before_change
from store.instances import insert_instance
from store.memory import Memory
from store.observations import Answer, Joins
from store.records import Category, Instance, Observation
from store.retention import Retention

FEATURES = {"a": np.arange(3)}


def answer(category_id: str) -> Answer:
    return Answer("known", category_id, None, Decision("known", "paper_mean", 0.4, ((category_id, 0.9),)), None, None, None, {})


def seen(memory: Memory, category_id: str, burst: Burst, encoded: EncodedBurst) -> Observation:
    """An observation that joined the category."""
    return memory.observations.create(answer(category_id), burst, FEATURES, joins=Joins(category_id, encoded, 0.9, "decision"))


@pytest.fixture
def joined(memory: Memory, category: Category, burst: Burst, encoded: EncodedBurst) -> Instance:
    """A second instance of the category."""
    seen(memory, category.id, burst, encoded)
    return memory.instances.of(category.id)[-1]


def test_the_scan_is_the_first_instance(
    memory: Memory, reference: Reference, burst: Burst, encoded: EncodedBurst, request_for_views: ScanRequest
) -> None:
    scan = memory.scans.create(request_for_views)
    category = memory.categories.create(reference, burst, encoded, scan_id=scan.id)
    (instance,) = memory.instances.of(category.id)
    assert (instance.source, instance.source_id, instance.how, instance.similarity) == ("scan", scan.id, "scan", None)


def test_an_observation_joins_in_the_step_that_keeps_it(memory: Memory, category: Category, burst: Burst, encoded: EncodedBurst) -> None:
    before = memory.version
    observation = seen(memory, category.id, burst, encoded)
    assert memory.version == before + 1
    joined = memory.instances.of(category.id)[-1]
    assert (joined.source, joined.source_id, joined.how, joined.similarity) == ("observation", observation.id, "decision", 0.9)


def test_an_observation_that_cannot_join_is_not_kept(
    memory: Memory, category: Category, other: Category, burst: Burst, encoded: EncodedBurst
) -> None:
    memory.categories.merge(category.id, other.id)
    for gone in ("gone", category.id):
        with pytest.raises(Conflict, match="meanwhile; send the request again"):
            memory.observations.create(answer(gone), burst, FEATURES, joins=Joins(gone, encoded, 0.9, "decision"))
    assert memory.observations.latest(1) == []


def test_its_views_come_back(memory: Memory, category: Category, joined: Instance, burst: Burst) -> None:
    for instance in memory.instances.of(category.id):
        assert np.array_equal(memory.instances.burst(instance.id).views[1].rgb, burst.views[1].rgb)


def test_views_end_with_their_observation_but_tokens_stay(folder, reference: Reference, burst: Burst, encoded: EncodedBurst) -> None:
    with Memory.open(folder, Retention(observations=1)) as memory:
        category = memory.categories.create(reference, burst, encoded)
        first, second = (seen(memory, category.id, burst, encoded) for _ in range(2))
        _, dropped, kept = memory.instances.of(category.id)
        assert (dropped.kept, dropped.source_id) == (False, first.id)
        assert (kept.kept, kept.source_id) == (True, second.id)
        with pytest.raises(Unavailable, match="no longer kept"):
            memory.instances.burst(dropped.id)
        assert len(memory.instances.members()) == 3


def test_a_forgotten_one_is_no_member(memory: Memory, category: Category, joined: Instance) -> None:
    memory.instances.forget(category.id, joined.id)
    assert len(memory.instances.members()) == 1
    assert memory.categories.get(category.id).instances == 1
    with pytest.raises(NotFound):
        memory.instances.get(joined.id)


def test_the_last_one_stays(memory: Memory, category: Category) -> None:
    (only,) = memory.instances.of(category.id)
    with pytest.raises(Conflict, match="delete the category instead"):
        memory.instances.forget(category.id, only.id)
    assert memory.categories.get(category.id).instances == 1


def test_only_of_its_own_category(memory: Memory, joined: Instance, other: Category) -> None:
    with pytest.raises(NotFound, match="has no instance"):
        memory.instances.forget(other.id, joined.id)


def test_one_that_leaves_meanwhile_is_not_forgotten(memory: Memory, category: Category, joined: Instance, reference, burst) -> None:
    def split() -> None:
        before_change.reset(token)
        memory.categories.split(category.id, [joined.id], reference, burst)

    token = before_change.set(split)
    with pytest.raises(NotFound, match="has no instance"):
        memory.instances.forget(category.id, joined.id)
    assert [each.instances for each in memory.categories.all()] == [1, 1]


def test_merging_moves_every_burst(memory: Memory, category: Category, joined: Instance, other: Category) -> None:
    merged = memory.categories.merge(category.id, other.id)
    assert (merged.id, merged.name, merged.instances) == (other.id, "mug", 3)
    assert {member.category_id for member in memory.instances.members()} == {other.id}
    assert [each.id for each in memory.categories.all()] == [other.id]


def test_nothing_merges_with_itself_or_with_what_is_gone(memory: Memory, category: Category) -> None:
    with pytest.raises(InvalidInput, match="itself"):
        memory.categories.merge(category.id, category.id)
    with pytest.raises(NotFound):
        memory.categories.merge(category.id, "gone")
    assert memory.categories.get(category.id).instances == 1


def test_splitting_takes_bursts_along(memory: Memory, category: Category, joined: Instance, reference: Reference) -> None:
    part = memory.categories.split(category.id, [joined.id], reference, memory.instances.burst(joined.id), name="glass")
    assert (part.name, part.views, part.instances) == ("glass", 3, 1)
    assert memory.instances.get(joined.id).category_id == part.id
    assert memory.categories.get(category.id).instances == 1
    assert np.array_equal(memory.categories.reference(part.id).cloud_m, reference.cloud_m)


def test_a_part_is_neither_nothing_nor_all_nor_another_s(
    memory: Memory, category: Category, joined: Instance, other: Category, reference: Reference, burst: Burst
) -> None:
    everything = [each.id for each in memory.instances.of(category.id)]
    for wrong in ([], everything):
        with pytest.raises(InvalidInput, match="at least one and not all"):
            memory.categories.split(category.id, wrong, reference, burst)
    with pytest.raises(NotFound, match="has no instance"):
        memory.categories.split(other.id, [joined.id], reference, burst)
    assert len(list(memory.categories.root.iterdir())) == 2


def test_damaged_tokens_are_left_out_and_the_rest_goes_on(memory: Memory, category: Category, joined: Instance, caplog) -> None:
    with memory._connection.change() as db:
        db.execute("UPDATE instances SET cls = zeroblob(4) WHERE id = ?", [joined.id])
    assert len(memory.instances.members()) == 1
    assert joined.id in caplog.text


@pytest.mark.parametrize("blob", [arrays.tokens_to_blob(np.full((3, 8), np.nan)), bytes(4), bytes(3), bytes(3 * 16 * 4)])
def test_means_of_damaged_tokens_are_left_out_and_told(
    memory: Memory, category: Category, joined: Instance, caplog: pytest.LogCaptureFixture, blob: bytes
) -> None:
    (first,) = (each for each in memory.instances.of(category.id) if each.id != joined.id)
    with memory._connection.change() as db:
        db.execute("UPDATE instances SET pooled = ? WHERE id = ?", [blob, joined.id])
    assert list(memory.instances.pooled_means([first.id, joined.id])) == [first.id]
    assert joined.id in caplog.text


def fill(folder: Path, encoded: EncodedBurst, count: int) -> None:
    """So many categories of one burst each, of rows alone."""
    connection = Connection(folder)
    with connection.change() as db:
        rows = [{"id": f"{number}", "created_at": "", "views": 3, "extent_m": "[1,1,1]", "reference_sha256": ""} for number in range(count)]
        db.table("categories").insert_all([row | {"files": "{}", "origin_id": row["id"]} for row in rows])
        rng = np.random.default_rng(0)
        for row in rows:
            views = [replace(view, pooled=rng.normal(size=8).astype(np.float32)) for view in encoded.views]
            insert_instance(db, row["id"], replace(encoded, views=tuple(views)), source="scan", source_id=None, how="scan")
    connection.close()


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> list[bytes]:
    """Parts that are taken from rows."""
    taken: list[bytes] = []
    take = instances.parts_from_blob

    def noted(blob: bytes, *shape: int) -> Array:
        taken.append(blob)
        return take(blob, *shape)

    monkeypatch.setattr(instances, "parts_from_blob", noted)
    monkeypatch.setattr(arrays, "read_whole", lambda *_: pytest.fail("a file of arrays is read"))
    return taken


def test_opening_reads_no_tokens_and_a_decision_only_those_near(folder: Path, encoded: EncodedBurst, reads: list[bytes]) -> None:
    Memory.open(folder).close()
    fill(folder, encoded, 1000)
    with Memory.open(folder) as memory:
        assert reads == []
        decide(memory.instances.enrolled(None), encoded)
        first = len(reads)
        assert first <= ADAPTED_FROM + NEAREST * (NEAREST + 2)
        decide(memory.instances.enrolled(None), encoded)
        assert len(reads) == first


def test_members_are_listed_anew_only_where_they_changed(memory: Memory, category: Category, other: Category, burst, encoded) -> None:
    listed = memory.instances.listed()
    assert memory.instances.listed() is listed
    memory.categories.rename(category.id, "another name")
    memory.observations.create(answer(category.id), burst, FEATURES)
    assert memory.instances.listed() is listed
    memory.observations.create(answer(category.id), burst, FEATURES, joins=Joins(category.id, encoded, 0.9, "decision"))
    joined = memory.instances.listed()
    assert [each.category_id for each in joined] == [category.id, other.id, category.id]
    memory.categories.merge(category.id, other.id)
    assert [each.category_id for each in memory.instances.listed()] == [other.id] * 3
    memory.undo(memory.audit.latest(1)[0].id)
    assert memory.instances.listed() == joined
    memory.instances.forget(category.id, joined[2].id)
    memory.categories.delete(other.id)
    assert [each.category_id for each in memory.instances.listed()] == [category.id]


def test_a_decision_leaves_out_damaged_parts(memory: Memory, category: Category, joined: Instance, encoded: EncodedBurst, caplog) -> None:
    connection = Connection(memory.folder)
    with connection.change() as db:
        db.execute("UPDATE instances SET parts = zeroblob(length(parts)) WHERE id = ?", [joined.id])
    connection.close()
    for _ in range(2):
        assert decide(memory.instances.enrolled(None), encoded).similarities[0][0] == category.id
    assert caplog.text.count("are damaged and left out") == 1
