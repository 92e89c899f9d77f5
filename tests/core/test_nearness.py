"""The members nearest to a burst, of all there are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.nearness import Listed, Nearness

ROOM = np.random.default_rng(1).normal(size=(120, 48))
"""Mean pooled tokens, one a kind of thing."""


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
    vectors = {each.id: row for each, row in zip(listed, ROOM)}
    asked: list[str] = []

    def give(ids: Sequence[str]) -> dict[str, np.ndarray]:
        asked.extend(ids)
        return {each: vectors[each] for each in ids}

    at_once, in_turn = Nearness(), Nearness()
    for stop in (3, 4, 20, 50, 40):
        in_turn.update(listed[:stop], give)
    assert len(asked) == 50  # each once
    at_once.update(listed[:40], give)
    assert in_turn.nearest(ROOM[:3], 7) == at_once.nearest(ROOM[:3], 7)
