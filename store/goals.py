"""Goals: where objects of a category should end, each stored once, by a pose of the reference."""

from __future__ import annotations

from core.errors import NotFound
from core.rearrange import Anchor
from core.sim3 import Sim3
from store.categories import Categories
from store.columns import sim3_from_json, sim3_to_json
from store.connection import Connection, Row, new_id
from store.records import Goal
from store.times import now

SELECT = "SELECT g.* FROM goals g JOIN categories c ON c.id = g.category_id WHERE c.removed_by IS NULL"


class Goals:
    """The goals of one memory."""

    def __init__(self, connection: Connection, categories: Categories) -> None:
        self._connection = connection
        self._categories = categories

    def create(
        self,
        category_id: str,
        name: str | None,
        target_from_reference: Sim3,
        *,
        frame: str | None = None,
        anchor: Anchor = "center",
        observation_id: str | None = None,
    ) -> Goal:
        """Raises NotFound for an unknown category, and Conflict where the observation is gone."""
        goal_id = new_id()
        with self._connection.change(goal_id) as db:
            self._categories.get(category_id)
            row = {"id": goal_id, "category_id": category_id, "created_at": now(), "name": name, "frame": frame, "anchor": anchor}
            pose = {"target_from_reference": sim3_to_json(target_from_reference), "observation_id": observation_id}
            db.table("goals").insert(row | pose)
        return self.get(goal_id)

    def of(self, category_id: str) -> list[Goal]:
        """Those of a category, oldest first. Raises NotFound."""
        self._categories.get(category_id)
        return [_goal(row) for row in self._connection.rows(f"{SELECT} AND g.category_id = ? ORDER BY g.rowid", category_id)]

    def get(self, goal_id: str) -> Goal:
        """Raises NotFound."""
        row = self._connection.row(f"{SELECT} AND g.id = ?", goal_id)
        if row is None:
            raise NotFound(f"no goal has the id {goal_id!r}; GET /v1/categories/{{id}}/goals lists a category's")
        return _goal(row)

    def delete(self, goal_id: str) -> None:
        """Raises NotFound."""
        with self._connection.change(goal_id) as db:
            self.get(goal_id)
            db.execute("DELETE FROM goals WHERE id = ?", [goal_id])


def _goal(row: Row) -> Goal:
    return Goal(**row | {"target_from_reference": sim3_from_json(row["target_from_reference"])})
