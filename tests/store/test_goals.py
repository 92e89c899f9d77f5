"""Goals come back as they were set, and live with their category."""

from __future__ import annotations

import numpy as np
import pytest

from core.errors import Conflict, NotFound
from core.sim3 import Sim3
from store.memory import Memory
from store.records import Category

PLACED = Sim3(0.9, np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.array([1.0, 2, 3]))


def test_a_goal_comes_back(memory: Memory, category: Category) -> None:
    made = memory.goals.create(category.id, "shelf", PLACED, frame="map", anchor="base")
    goal = memory.goals.get(made.id)
    assert np.array_equal(goal.target_from_reference.as_matrix(), PLACED.as_matrix())
    assert (goal.category_id, goal.name, goal.frame, goal.anchor, goal.observation_id) == (category.id, "shelf", "map", "base", None)


def test_a_category_has_its_own_goals(memory: Memory, category: Category, other: Category) -> None:
    made = [memory.goals.create(category.id, name, PLACED).id for name in ("a", "b")]
    assert [goal.id for goal in memory.goals.of(category.id)] == made
    assert memory.goals.of(other.id) == []


def test_a_deleted_goal_is_gone(memory: Memory, category: Category) -> None:
    goal = memory.goals.create(category.id, None, PLACED)
    memory.goals.delete(goal.id)
    for ask in (memory.goals.get, memory.goals.delete):
        with pytest.raises(NotFound):
            ask(goal.id)


def test_goals_are_not_seen_while_their_category_is_deleted(memory: Memory, category: Category) -> None:
    goal = memory.goals.create(category.id, None, PLACED)
    memory.categories.delete(category.id)
    with pytest.raises(NotFound):
        memory.goals.get(goal.id)
    with pytest.raises(NotFound):
        memory.goals.create(category.id, None, PLACED)


def test_a_goal_of_an_observation_that_is_gone_is_refused(memory: Memory, category: Category) -> None:
    with pytest.raises(Conflict):
        memory.goals.create(category.id, None, PLACED, observation_id="gone")
