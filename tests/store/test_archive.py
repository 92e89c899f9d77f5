"""Categories travel from one memory to another, which then knows what the first knew."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from core.encode import EncodedBurst
from core.errors import Conflict, NotFound, Unavailable
from core.novelty import DecisionConfig, decide
from core.reference import Reference
from core.scores import SCORES
from core.views import Burst
from store.connection import before_change
from store.memory import Memory
from store.records import Category


def test_everything_about_a_category_arrives(learnt: Memory, second: Memory, archive: Path, burst: Burst, reference: Reference) -> None:
    report = second.import_archive(archive, actor="anna")
    assert [(each.name, each.instances, each.goals) for each in report.categories] == [("cup", 1, 1), ("mug", 1, 0)]
    for mine, theirs in zip(second.categories.all(), learnt.categories.all(), strict=True):
        assert mine.id != theirs.id
        assert (mine.name, mine.origin_id, mine.created_at, mine.views) == (theirs.name, theirs.id, theirs.created_at, theirs.views)
    cup = second.categories.all()[0].id
    found, kept = second.categories.reference(cup), learnt.categories.reference(report.categories[0].archive_id)
    assert all(np.array_equal(mine.descriptors, theirs.descriptors) for mine, theirs in zip(found.views, kept.views, strict=True))
    assert np.array_equal(second.categories.view(cup, 2).rgb, burst.views[2].rgb)
    (goal,) = second.goals.of(cup)
    assert (goal.name, goal.frame, goal.anchor) == ("shelf", "map", "base")
    (instance,) = second.instances.of(cup)
    assert (instance.how, instance.source, instance.pictures) == ("scan", "scan", f"categories/{cup}")
    assert second.check().ok
    entry = second.audit.get(report.entry_id)
    assert (entry.actor, entry.action, entry.after["archive"]) == ("anna", "import", "all.zip")


def test_memories_imported_into_each_other_answer_alike(
    learnt: Memory, second: Memory, archive: Path, reference: Reference, burst: Burst, encoded: EncodedBurst, tmp_path: Path
) -> None:
    turned = EncodedBurst(tuple(replace(view, cls=-view.cls, pooled=view.pooled[::-1].copy()) for view in encoded.views), "fingerprint-a")
    second.categories.create(reference, burst, turned, name="bowl")
    theirs = second.export(tmp_path / "theirs.zip").path
    assert [each.name for each in second.import_archive(archive).categories] == ["cup", "mug"]
    assert [each.name for each in learnt.import_archive(theirs).categories] == ["bowl"]
    names = [{category.id: category.name for category in memory.categories.all()} for memory in (learnt, second)]
    for score in SCORES:
        for asked in (encoded, turned):
            answers = [decide(memory.instances.members(), asked, DecisionConfig(score)) for memory in (learnt, second)]
            assert answers[0].outcome == answers[1].outcome
            told = [sorted((own[each], similarity) for each, similarity in answer.similarities) for own, answer in zip(names, answers)]
            assert told[0] == told[1]
    again = learnt.import_archive(second.export(tmp_path / "again.zip").path)
    assert (again.categories, sorted(each.name for each in again.duplicates)) == ((), ["bowl", "cup", "mug"])


def test_only_what_is_chosen_is_exported(learnt: Memory, second: Memory, other: Category, tmp_path: Path) -> None:
    second.import_archive(learnt.export(tmp_path / "one.zip", [other.id]).path)
    assert [each.name for each in second.categories.all()] == ["mug"]
    with pytest.raises(NotFound):
        learnt.export(tmp_path / "none.zip", ["gone"])
    assert not (tmp_path / "none.zip").exists()


def test_an_empty_memory_takes_the_backbone_of_the_archive(archive: Path, tmp_path: Path) -> None:
    with Memory.open(tmp_path / "new") as new:
        new.import_archive(archive)
        assert (new.backbone, new.fingerprint) == ("colour", "fingerprint-a")


def test_another_backbone_is_refused_with_the_remedy(archive: Path, tmp_path: Path) -> None:
    with Memory.open(tmp_path / "new") as new:
        new.require_backbone("dino-s8", "fingerprint-b")
        with pytest.raises(Conflict, match="reembed"):
            new.import_archive(archive)
        assert new.categories.all() == []


def test_names_that_were_there_before_are_told(
    second: Memory, archive: Path, reference: Reference, burst: Burst, encoded: EncodedBurst
) -> None:
    mine = second.categories.create(reference, burst, encoded, name="cup")
    assert [each.same_name for each in second.import_archive(archive).categories] == [(mine.id,), ()]


def test_an_archive_that_comes_twice_at_once_is_taken_once(second: Memory, archive: Path) -> None:
    def the_other() -> None:
        before_change.reset(token)
        second.import_archive(archive)

    token = before_change.set(the_other)
    with pytest.raises(Conflict, match="import it again"):
        second.import_archive(archive)
    assert [each.name for each in second.categories.all()] == ["cup", "mug"]
    assert len(list(second.categories.root.iterdir())) == 2


def test_a_deleted_category_may_come_again(second: Memory, archive: Path) -> None:
    second.import_archive(archive)
    second.categories.delete(second.categories.all()[0].id)
    assert [each.name for each in second.import_archive(archive).categories] == ["cup"]


def test_a_damaged_category_is_not_exported_but_the_others_are(learnt: Memory, category: Category, other: Category, tmp_path: Path) -> None:
    (learnt.categories.folder(category.id) / "000_rgb.png").unlink()
    with pytest.raises(Unavailable, match="cup.* damaged: 000_rgb.png is missing"):
        learnt.export(tmp_path / "all.zip")
    assert learnt.export(tmp_path / "all.zip", [other.id]).categories == 1


def test_a_category_without_sound_tokens_is_not_exported_and_is_named(
    learnt: Memory, category: Category, other: Category, tmp_path: Path
) -> None:
    with learnt._connection.change() as db:
        db.execute("UPDATE instances SET cls = zeroblob(4) WHERE category_id = ?", [category.id])
    with pytest.raises(Unavailable, match="cup.* damaged: no burst of it has the tokens that were written; restore it"):
        learnt.export(tmp_path / "all.zip")
    assert learnt.export(tmp_path / "all.zip", [other.id]).categories == 1


def test_a_damaged_instance_is_left_out_and_counted(
    learnt: Memory, category: Category, other: Category, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (damaged,) = learnt.instances.of(category.id)
    learnt.categories.merge(category.id, other.id)
    assert learnt.export(tmp_path / "whole.zip").left_out == 0
    with learnt._connection.change() as db:
        db.execute("UPDATE instances SET cls = zeroblob(4) WHERE id = ?", [damaged.id])
    assert learnt.export(tmp_path / "all.zip").left_out == 1
    assert f"leaves out 1 damaged instances of category {other.id}" in caplog.text


def test_an_export_never_replaces_a_file_and_is_never_empty(learnt: Memory, second: Memory, archive: Path, tmp_path: Path) -> None:
    with pytest.raises(Conflict, match="exists"):
        learnt.export(archive)
    with pytest.raises(Conflict, match="no categories"):
        second.export(tmp_path / "none.zip")


def test_an_export_that_cannot_be_written_is_told_with_the_remedy(learnt: Memory, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(Unavailable, match="cannot export to .*; free space, or choose another file"):
        learnt.export(tmp_path / "file" / "all.zip")


def test_the_same_categories_make_the_same_entries(learnt: Memory, archive: Path, tmp_path: Path) -> None:
    def content(path: Path) -> dict[str, bytes]:
        with zipfile.ZipFile(path) as file:
            return {name: file.read(name) for name in file.namelist() if name != "manifest.json"}

    assert content(learnt.export(tmp_path / "again.zip").path) == content(archive)
