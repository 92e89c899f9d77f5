"""Members kept ready: a small memory is compared by the exact rule, a larger one nearly so, and nothing is read that need not be."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from unittest.mock import Mock

import numpy as np
import pytest

from core.backbones.whitening import Whitening
from core.encode import EncodedBurst
from core.enrolled import ADAPTED_FROM, EXACT, NEAREST, Enrolled, adapted_from
from core.errors import InvalidInput
from core.evidence import PARTS
from core.nearness import Listed
from core.novelty import Context, DecisionConfig, Member, decide

from .conftest import PaintedObject

DIM, VIEWS = 48, 3
ROOM = np.random.default_rng(1).normal(size=(400, DIM))
"""Directions of tokens, one a kind of thing."""
WHITENING = Whitening.fit(np.random.default_rng(2).normal(size=(500, DIM)) * np.linspace(0.5, 2, DIM) + 0.3)


def tokens(kind: int, seed: int) -> np.ndarray:
    """Parts of an instance of a kind of thing, shape (VIEWS, PARTS, DIM)."""
    rng = np.random.default_rng([kind, seed])
    return ROOM[kind] + 0.3 * rng.normal(size=DIM) + 0.8 * rng.normal(size=(VIEWS, PARTS, DIM))


class Kept:
    """Members in memory that note what is asked for."""

    def __init__(self, members: Sequence[tuple[str, int, int]]) -> None:
        """Of each its id, and the kind and seed of its tokens."""
        self.of = {name: (kind, seed) for name, kind, seed in members}
        self.merged: dict[str, int] = {}
        """Into which kind's category."""
        self.damaged: set[str] = set()
        self.read: list[str] = []
        self._listed: list[Listed] = []

    def listed(self) -> Sequence[Listed]:
        now = [Listed(name, self._category(name)) for name in self.of]
        if now != self._listed:
            self._listed = now
        return self._listed

    def pooled_means(self, ids: Sequence[str]) -> Mapping[str, np.ndarray]:
        return {each: tokens(*self.of[each]).mean(axis=(0, 1)) for each in ids}

    def parts(self, ids: Sequence[str]) -> Mapping[str, np.ndarray]:
        self.read += ids
        return {each: tokens(*self.of[each]).astype(np.float16) for each in ids if each not in self.damaged}

    def members(self) -> list[Member]:
        found = {name: tokens(*about) for name, about in self.of.items()}
        return [Member(self._category(name), *[each.mean(axis=1)] * 2, each.astype(np.float16)) for name, each in found.items()]

    def _category(self, name: str) -> str:
        return f"kind {self.merged.get(name, self.of[name][0])}"


def one_each(kinds: int) -> Kept:
    """So many categories of one member each."""
    return Kept([(f"m{kind}", kind, 0) for kind in range(kinds)])


@pytest.fixture
def seen(painted: PaintedObject) -> Callable[[int, int], EncodedBurst]:
    return lambda kind, seed: painted.with_tokens(tokens(kind, seed))


def check_exact(kept: Kept, enrolled: Enrolled, burst: EncodedBurst) -> None:
    """Asserts that a decision is the exact rule's, number by number."""
    ours, rule = decide(enrolled, burst), decide(kept.members(), burst, context=Context(WHITENING))
    assert [category for category, _ in ours.similarities] == [category for category, _ in rule.similarities]
    np.testing.assert_allclose([each for _, each in ours.similarities], [each for _, each in rule.similarities], atol=2e-5)
    assert (ours.outcome, ours.rival) == (rule.outcome, pytest.approx(rule.rival, abs=2e-5))


def test_a_small_memory_is_decided_by_the_exact_rule_while_it_changes(seen: Callable[[int, int], EncodedBurst]) -> None:
    kept = Kept([(f"m{kind}-{seed}", kind, seed) for kind in range(8) for seed in range(2)])
    enrolled = Enrolled(kept, WHITENING)
    for kind in range(0, 12, 3):
        check_exact(kept, enrolled, seen(kind, 9))
    kept.of["new"] = (20, 0)
    check_exact(kept, enrolled, seen(20, 9))
    kept.of["another"] = (2, 5)
    del kept.of["m0-0"]
    check_exact(kept, enrolled, seen(2, 9))
    kept.merged["m3-0"] = 4
    check_exact(kept, enrolled, seen(4, 9))
    assert enrolled.exact


def test_at_the_last_exact_size_nothing_is_approximate(seen: Callable[[int, int], EncodedBurst]) -> None:
    kept = one_each(EXACT)
    check_exact(kept, Enrolled(kept, WHITENING), seen(40, 9))


def test_a_memory_of_one_member_is_decided_by_the_exact_rule(seen: Callable[[int, int], EncodedBurst]) -> None:
    kept = one_each(1)
    for kind in (0, 1):
        check_exact(kept, Enrolled(kept, WHITENING), seen(kind, 9))


def test_an_empty_memory_finds_everything_novel(seen: Callable[[int, int], EncodedBurst]) -> None:
    assert decide(Enrolled(Kept([]), WHITENING), seen(0, 0)).outcome == "novel"


def test_of_a_large_memory_the_right_category_is_found_with_nearly_the_exact_evidence(seen: Callable[[int, int], EncodedBurst]) -> None:
    kept = one_each(300)
    enrolled = Enrolled(kept, WHITENING)
    for kind in range(0, 300, 30):
        ours, rule = decide(enrolled, seen(kind, 9)), decide(kept.members(), seen(kind, 9), context=Context(WHITENING))
        assert ours.similarities[0][0] == rule.similarities[0][0] == f"kind {kind}"
        assert ours.similarity == pytest.approx(rule.similarity, abs=0.02)
    assert not enrolled.exact


def test_a_large_memory_is_not_read_again(seen: Callable[[int, int], EncodedBurst]) -> None:
    kept = one_each(390)
    enrolled = Enrolled(kept, WHITENING)
    decide(enrolled, seen(7, 9))
    assert len(set(kept.read)) <= ADAPTED_FROM + (NEAREST + 1) * 8
    kept.read.clear()
    decide(enrolled, seen(7, 9))
    assert kept.read == []
    kept.of["new"] = (395, 0)
    decide(enrolled, seen(395, 9))
    assert "new" in kept.read
    assert len(kept.read) < ADAPTED_FROM


def test_what_is_no_longer_kept_is_read_again(seen: Callable[[int, int], EncodedBurst], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("core.enrolled.KEPT", 4)
    monkeypatch.setattr("core.enrolled.KEPT_COHORTS", 2)
    kept = one_each(8)
    enrolled = Enrolled(kept, WHITENING)
    check_exact(kept, enrolled, seen(3, 9))
    kept.read.clear()
    check_exact(kept, enrolled, seen(5, 9))
    assert kept.read


def test_a_read_that_fails_once_is_tried_again(seen: Callable[[int, int], EncodedBurst], monkeypatch: pytest.MonkeyPatch) -> None:
    kept = one_each(5)
    enrolled = Enrolled(kept, WHITENING)
    with monkeypatch.context() as failing:
        failing.setattr(kept, "pooled_means", Mock(side_effect=OSError("disk")))
        with pytest.raises(OSError, match="disk"):
            decide(enrolled, seen(3, 9))
    check_exact(kept, enrolled, seen(3, 9))


def test_what_is_damaged_is_left_out_and_the_rest_goes_on(seen: Callable[[int, int], EncodedBurst]) -> None:
    for kinds in (10, 100):
        kept = one_each(kinds)
        kept.damaged = {"m7"}
        found = dict(decide(Enrolled(kept, WHITENING), seen(7, 9)).similarities)
        assert "kind 7" not in found
        assert len(found) == 5


def test_a_memory_all_of_which_is_damaged_finds_everything_novel(seen: Callable[[int, int], EncodedBurst]) -> None:
    kept = one_each(3)
    kept.damaged = set(kept.of)
    assert decide(Enrolled(kept, WHITENING), seen(1, 9)).outcome == "novel"


def test_a_restarted_service_decides_the_same(seen: Callable[[int, int], EncodedBurst]) -> None:
    kept = one_each(90)
    grown = Enrolled(kept, WHITENING)
    decide(grown, seen(3, 9))
    for kind in range(90, 130):
        kept.of[f"m{kind}"] = (kind, 0)
        decide(grown, seen(kind, 9))
    ours, restarted = (decide(each, seen(100, 9)) for each in (grown, Enrolled(kept, WHITENING)))
    assert [category for category, _ in ours.similarities] == [category for category, _ in restarted.similarities]
    assert ours.similarity == pytest.approx(restarted.similarity, abs=1e-5)


def test_the_sample_that_a_memory_is_adapted_to_changes_seldom() -> None:
    samples = [tuple(adapted_from(count)) for count in range(1, 3000)]
    assert samples[EXACT - 1] == tuple(range(EXACT))
    assert len(set(samples[EXACT:])) < 20
    assert all(sample[-1] < count for count, sample in enumerate(samples, start=1))
    assert max(map(len, samples)) == ADAPTED_FROM


def test_enrolled_members_serve_no_paper_score(seen: Callable[[int, int], EncodedBurst]) -> None:
    with pytest.raises(InvalidInput, match="members themselves"):
        decide(Enrolled(one_each(2), None), seen(0, 0), DecisionConfig("paper_mean"))
