"""Another backbone computes a memory anew from the views it kept, whole or not at all."""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from core.backbones.base import Backbone
from core.encode import EncodedBurst, Encoder
from core.errors import Conflict, Unavailable
from core.novelty import Decision, DecisionConfig, decide
from core.packing import burst_as_arrays
from core.reference import build_reference
from core.sim3 import Sim3
from core.views import Burst
from store import reembed
from store.memory import Memory
from store.observations import Joins
from store.progress import Progress
from store.records import Category
from tests.store.conftest import KNOWN, NOVEL


@pytest.fixture(scope="module")
def cup(look: Callable[..., Burst]) -> Burst:
    """Four views of an object."""
    return look(views=4)


@pytest.fixture
def other(backbone: Backbone) -> Backbone:
    """The same with other weights."""

    class Other(type(backbone)):
        name = "hue"
        fingerprint = "hue-1"

        def __init__(self) -> None:
            super().__init__()
            self._waves = np.random.default_rng(7).normal(scale=1 / 25, size=self._waves.shape)

    return Other()


@pytest.fixture
def learnt(folder: Path, backbone: Backbone, cup: Burst) -> Iterator[Memory]:
    """A category of two bursts, the second from an observation."""
    with Memory.open(folder) as memory:
        memory.require_backbone(backbone.name, backbone.fingerprint)
        encoded = Encoder(backbone).encode(cup)
        category = memory.categories.create(build_reference(encoded), cup, encoded, name="cup")
        joins = Joins(category.id, encoded, 0.9, "decision")
        memory.observations.create(KNOWN, cup, burst_as_arrays(encoded), joins=joins)
        memory.goals.create(category.id, "shelf", Sim3.identity())
        memory.keep_setting("threshold", 0.3)
        yield memory


@pytest.fixture
def category(learnt: Memory) -> Category:
    """Its category."""
    return learnt.categories.all()[0]


def files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*.npz"))}


def test_everything_is_what_the_other_backbone_makes(learnt: Memory, category: Category, other: Backbone, cup: Burst) -> None:
    told: list[tuple[int, int]] = []
    result = learnt.reembed(other, actor="anna", progress=lambda done, total: told.append((done, total)))
    assert (result.categories, result.instances, result.observations) == (1, 2, 1)
    assert (result.dropped_instances, result.dropped_observations) == (0, 0)
    assert told == [(1, 2), (2, 2)]
    assert (learnt.backbone, learnt.fingerprint, learnt.setting("threshold")) == ("hue", "hue-1", None)
    expected = Encoder(other).encode(cup)
    for member in learnt.instances.members():
        np.testing.assert_allclose(member.pooled, expected.pooled, atol=1e-4)
    reference = learnt.categories.reference(category.id)
    assert reference.fingerprint == "hue-1"
    np.testing.assert_allclose(reference.views[0].descriptors, expected.views[0].descriptors, atol=2e-3)
    assert decide(learnt.instances.members(), expected, DecisionConfig("pooled_best_view")).outcome == "known"
    (seen,) = learnt.observations.latest(1)
    assert str(learnt.observations.features(seen.id)["fingerprint"]) == "hue-1"


def test_what_people_said_stays(learnt: Memory, category: Category, other: Backbone) -> None:
    instances = [vars(each) for each in learnt.instances.of(category.id)]
    learnt.reembed(other)
    after = learnt.categories.get(category.id)
    assert (after.name, after.created_at, after.instances) == ("cup", category.created_at, 2)
    assert [vars(each) for each in learnt.instances.of(category.id)] == instances
    assert [goal.name for goal in learnt.goals.of(category.id)] == ["shelf"]


def test_it_is_whole_and_opens_with_the_other_backbone_only(learnt: Memory, other: Backbone, backbone: Backbone) -> None:
    learnt.reembed(other)
    assert learnt.check().ok
    assert len(files(learnt.folder)) == 2
    learnt.close()
    with Memory.open(learnt.folder) as again:
        again.require_backbone(other.name, other.fingerprint)
        with pytest.raises(Conflict, match="onelook memory reembed --backbone colour"):
            again.require_backbone(backbone.name, backbone.fingerprint)


def test_stopped_on_the_way_it_is_what_it_was(learnt: Memory, category: Category, other: Backbone, backbone: Backbone) -> None:
    before = files(learnt.folder)

    def stop(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        learnt.reembed(other, progress=stop)
    assert files(learnt.folder) == before
    assert learnt.fingerprint == backbone.fingerprint
    assert learnt.categories.reference(category.id).fingerprint == backbone.fingerprint


def test_on_a_full_disk_it_is_what_it_was(learnt: Memory, other: Backbone, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    before = files(learnt.folder)
    monkeypatch.setattr(reembed, "sync", full)
    with pytest.raises(Unavailable, match="No space left on device; free space"):
        learnt.reembed(other)
    assert files(learnt.folder) == before


def test_a_category_without_its_views_stops_it_and_is_named(learnt: Memory, category: Category, other: Backbone) -> None:
    before = files(learnt.folder)
    (learnt.categories.folder(category.id) / "001_rgb.png").unlink()
    with pytest.raises(Unavailable, match="category cup cannot be computed anew.*nothing was changed"):
        learnt.reembed(other)
    assert files(learnt.folder) == before
    learnt.categories.delete(category.id)
    assert learnt.reembed(other).categories == 0


def test_bursts_whose_views_are_gone_are_dropped(learnt: Memory, category: Category, other: Backbone) -> None:
    with learnt._connection.change() as db:
        db.execute("UPDATE instances SET pictures = NULL")
    assert learnt.reembed(other).dropped_instances == 2
    (of_reference,) = learnt.instances.of(category.id)
    assert of_reference.kept
    assert len(learnt.instances.members()) == 1


def test_the_same_backbone_mends_damaged_arrays(learnt: Memory, category: Category, backbone: Backbone) -> None:
    (learnt.categories.folder(category.id) / "reference.npz").write_bytes(b"")
    with learnt._connection.change() as db:
        db.execute("UPDATE instances SET cls = zeroblob(4)")
    assert len(learnt.check().damages) == 3
    result = learnt.reembed(backbone)
    assert (result.instances, result.dropped_instances) == (2, 0)
    assert learnt.check().ok
    assert learnt.categories.reference(category.id).fingerprint == backbone.fingerprint
    assert learnt.setting("threshold") == 0.3


def test_what_is_in_the_bin_comes_back_with_the_other_backbone_too(learnt: Memory, category: Category, other: Backbone) -> None:
    learnt.categories.delete(category.id)
    entry = learnt.audit.latest(1)[0]
    learnt.reembed(other)
    learnt.undo(entry.id)
    assert learnt.categories.reference(category.id).fingerprint == "hue-1"
    assert len(learnt.instances.members()) == 2


def test_what_lost_its_bursts_in_the_bin_does_not_come_back_empty(learnt: Memory, category: Category, other: Backbone) -> None:
    with learnt._connection.change() as db:
        db.execute("UPDATE instances SET pictures = NULL")
    learnt.categories.delete(category.id)
    entry = learnt.audit.latest(1)[0]
    assert learnt.reembed(other).dropped_instances == 2
    assert learnt.instances.members() == []
    learnt.undo(entry.id)
    assert [each.how for each in learnt.instances.of(category.id)] == ["scan"]


def test_what_was_merged_gets_no_burst_of_its_own(
    learnt: Memory, category: Category, other: Backbone, cup: Burst, backbone: Backbone
) -> None:
    encoded = Encoder(backbone).encode(cup)
    second = learnt.categories.create(build_reference(encoded), cup, encoded)
    learnt.categories.merge(second.id, category.id)
    entry = learnt.audit.latest(1)[0]
    learnt.reembed(other)
    learnt.undo(entry.id)
    assert learnt.categories.get(second.id).instances == 1


def test_an_export_after_it_is_of_the_other_backbone(learnt: Memory, other: Backbone, tmp_path: Path) -> None:
    learnt.reembed(other)
    with Memory.open(tmp_path / "new") as new:
        new.import_archive(learnt.export(tmp_path / "all.zip").path)
        assert new.fingerprint == "hue-1"
        assert new.categories.reference(new.categories.all()[0].id).fingerprint == "hue-1"


def test_the_views_it_read_are_untouched(learnt: Memory, category: Category, other: Backbone, cup: Burst) -> None:
    learnt.reembed(other)
    assert np.array_equal(learnt.categories.view(category.id, 3).rgb, cup.views[3].rgb)


def test_tokens_of_the_first_backbone_are_not_remembered(learnt: Memory, other: Backbone, cup: Burst, backbone: Backbone) -> None:
    before: EncodedBurst = Encoder(backbone).encode(cup)
    assert decide(learnt.instances.members(), before, DecisionConfig("pooled_best_view")).similarities[0][1] > 0.99
    learnt.reembed(other)
    assert decide(learnt.instances.members(), before, DecisionConfig("pooled_best_view")).similarities[0][1] < 0.9


def judged(memory: Memory, category: Category, cup: Burst, backbone: Backbone) -> str:
    """The id of an observation that was decided with this backbone, and is a sample for later ones."""
    decision = Decision("novel", "best", float("inf"), ((category.id, 0.5),), rival=0.5)
    return memory.observations.create(replace(NOVEL, decision=decision), cup, burst_as_arrays(Encoder(backbone).encode(cup))).id


def test_what_the_first_backbone_found_is_no_sample_any_more(
    learnt: Memory, category: Category, other: Backbone, cup: Burst, backbone: Backbone
) -> None:
    seen = judged(learnt, category, cup, backbone)
    learnt.reembed(other)
    (decision,) = learnt.observations.decisions(9)
    assert (decision.score, decision.similarities) == ("best by colour", ((category.id, 0.5),))
    assert decision.corrected(category.id).rival is None
    assert learnt.observations.get(seen).decision == decision


def test_what_the_same_backbone_found_stays_a_sample(learnt: Memory, category: Category, cup: Burst, backbone: Backbone) -> None:
    judged(learnt, category, cup, backbone)
    learnt.reembed(backbone)
    assert [(decision.score, decision.rival) for decision in learnt.observations.decisions(9)] == [("best", 0.5)]


def test_an_observation_that_cannot_be_computed_goes_with_its_burst(learnt: Memory, category: Category, other: Backbone) -> None:
    (seen,) = learnt.observations.latest(1)
    (learnt.observations.folder(seen.id) / "000_rgb.png").unlink()
    result = learnt.reembed(other)
    assert (result.dropped_observations, result.dropped_instances) == (1, 1)
    assert learnt.observations.latest(1) == []
    assert not learnt.observations.folder(seen.id).exists()
    assert learnt.check().ok


def test_a_burst_whose_views_it_lost_says_that_it_may_have_been_so(learnt: Memory, category: Category, backbone: Backbone) -> None:
    (seen,) = learnt.observations.latest(1)
    (learnt.observations.folder(seen.id) / "000_rgb.png").unlink()
    learnt.reembed(backbone)
    _, stripped = learnt.instances.of(category.id)
    with pytest.raises(Unavailable, match="no longer kept: .*, `onelook memory reembed` could not use them, or"):
        learnt.instances.burst(stripped.id)


def once(work: Callable[[], object]) -> Progress:
    """Does something when it is told for the first time how far it is."""
    left = [work]
    return lambda done, total: left.pop()() if left else None


def test_what_is_computed_anew_meanwhile_is_not_called_damaged(learnt: Memory, other: Backbone) -> None:
    with Memory.reading(learnt.folder) as reader:
        assert reader.check(once(lambda: learnt.reembed(other))).ok


def test_a_backup_meanwhile_is_of_the_one_or_of_the_other(learnt: Memory, other: Backbone, tmp_path: Path) -> None:
    with Memory.reading(learnt.folder) as reader:
        backup = reader.backup(tmp_path / "copy", once(lambda: learnt.reembed(other)))
    assert backup.damages == ()
    with Memory.open(backup.folder) as copy:
        assert (copy.backbone, copy.check().ok) == ("hue", True)
