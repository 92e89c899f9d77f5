"""The members nearest to a burst, of all there are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from core.nearness import CENTRE_PRIOR, Listed, Nearness
from core.views import FloatArray

ROOM = np.random.default_rng(1).normal(size=(120, 48))
"""Mean pooled tokens, one a kind of thing."""


LIT = ROOM * np.linspace(0.5, 3, 120)[:, None] + 2
"""The same of a room whose light all tokens have in common, and of different length."""


LISTED = [Listed(f"{kind}", f"kind {kind}") for kind in range(9)]


def one_each(rows: FloatArray) -> Nearness:
    """So many categories of one member each."""
    near = Nearness()
    near.update([Listed(f"{kind}", f"kind {kind}") for kind in range(len(rows))], lambda ids: {each: rows[int(each)] for each in ids})
    return near


def test_the_nearest_are_those_of_largest_cosine_about_the_centre_nearest_first() -> None:
    centre = LIT[:50].sum(axis=0) / (50 + CENTRE_PRIOR)
    around, asked = LIT[:50] - centre, LIT[50:60] - centre
    cosines = asked @ around.T / np.linalg.norm(around, axis=1)
    for (members, founders), row in zip(one_each(LIT[:50]).nearest(LIT[50:60], 9), cosines, strict=True):
        assert members == founders == np.argsort(-row)[:9].tolist()


@pytest.mark.parametrize("there_are", [1, 6, 7])
def test_of_no_more_than_are_asked_for_all_are_near(there_are: int) -> None:
    ((members, founders),) = one_each(LIT[:there_are]).nearest(LIT[:1], 7)
    assert sorted(members) == sorted(founders) == list(range(there_are))
    assert members[0] == founders[0] == 0


def test_categories_of_many_bursts_leave_room_for_others() -> None:
    """A category with more bursts than are looked at is one of the nearest categories, not all of them."""
    near = Nearness()
    listed = [Listed(f"many {index}", "many") for index in range(60)] + [Listed(f"{kind}", f"kind {kind}") for kind in range(40)]
    vectors = {each.id: ROOM[0 if each.category_id == "many" else 1 + index] for index, each in enumerate(listed)}
    near.update(listed, lambda ids: {each: vectors[each] for each in ids})
    ((members, founders),) = near.nearest(ROOM[:1], 16)
    assert {listed[place].category_id for place in members} == {"many"}
    assert len(founders) == 16
    assert founders[0] == 0
    assert len({listed[place].category_id for place in founders}) == 16


def test_who_is_near_is_the_same_however_the_members_came() -> None:
    listed = [Listed(f"{kind}", f"kind {kind}") for kind in range(50)]
    vectors = {each.id: row for each, row in zip(listed, LIT)}
    asked: list[str] = []

    def give(ids: Sequence[str]) -> dict[str, np.ndarray]:
        asked.extend(ids)
        return {each: vectors[each] for each in ids}

    at_once, in_turn = Nearness(), Nearness()
    for there in (listed[:3], listed[:4], listed[:20], listed, listed[:40]):
        in_turn.update(there, give)
    assert len(asked) == 50  # each once
    at_once.update(listed[:40], give)
    assert in_turn.nearest(LIT[:3], 7) == at_once.nearest(LIT[:3], 7)


@pytest.mark.parametrize(
    "now",
    [LISTED[1:], LISTED[:4] + LISTED[5:], LISTED[::-1], [Listed("new", "new"), *LISTED], [*LISTED[:4], Listed("new", "new"), *LISTED[5:]]],
    ids=["the first went", "one went", "another order", "one came back before all", "one came in the place of another"],
)
def test_who_is_near_is_the_same_whoever_went_or_came_between(now: list[Listed]) -> None:
    vectors = {**{each.id: row for each, row in zip(LISTED, LIT)}, "new": LIT[90]}
    changed, at_once = Nearness(), Nearness()
    for there in (LISTED, now):
        changed.update(there, lambda ids: {each: vectors[each] for each in ids})
    at_once.update(now, lambda ids: {each: vectors[each] for each in ids})
    assert changed.members == now
    assert changed.nearest(LIT[:9], 3) == at_once.nearest(LIT[:9], 3)


def test_a_member_that_went_to_another_category_is_of_that() -> None:
    near = one_each(LIT[:9])
    near.update([*LISTED[:5], Listed("5", "kind 2"), *LISTED[6:]], lambda ids: {})
    ((members, founders),) = near.nearest(LIT[5:6], 1)
    assert (members, founders) == ([5], [2])
