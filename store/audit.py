"""The audit trail: who changed what was learnt, when, and how it was before and after."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from sqlite_utils import Database

from core.errors import NotFound
from store.connection import Connection, Row, new_id
from store.records import Action, AuditEntry
from store.times import ago, now

UNDOABLE: tuple[Action, ...] = ("rename", "merge", "split", "delete", "forget", "correct")


class Audit:
    """The audit trail of one memory."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def latest(self, limit: int, *, before: str | None = None) -> list[AuditEntry]:
        """The latest changes, newest first; those before another one where it is given. Raises NotFound for one that is not there."""
        older = "" if before is None else "WHERE rowid < (SELECT rowid FROM audit WHERE id = ?)"
        known = () if before is None else (self.get(before).id,)
        rows = self._connection.rows(f"SELECT * FROM audit {older} ORDER BY rowid DESC LIMIT ?", *known, limit)
        return [self._entry(row) for row in rows]

    def of(self, category_id: str, limit: int) -> list[AuditEntry]:
        """The latest changes of a category, newest first, also those that it gave bursts to or took them from."""
        others = ("after, '$.into'", "after, '$.category'", "before, '$.assigned.category_id'")
        mine = " OR ".join(f"json_extract({other}) = ?1" for other in others)
        query = f"SELECT * FROM audit WHERE category_id = ?1 OR {mine} ORDER BY rowid DESC LIMIT ?2"
        return [self._entry(row) for row in self._connection.rows(query, category_id, limit)]

    def get(self, entry_id: str) -> AuditEntry:
        """Raises NotFound."""
        row = self._connection.row("SELECT * FROM audit WHERE id = ?", entry_id)
        if row is None:
            raise NotFound(f"no change has the id {entry_id!r}")
        return self._entry(row)

    def _entry(self, row: Row) -> AuditEntry:
        recent = row["created_at"] > ago(self._connection.retention.undo)
        return AuditEntry(
            row["id"],
            row["created_at"],
            row["actor"],
            row["action"],
            row["category_id"],
            json.loads(row["before"]),
            json.loads(row["after"]),
            row["undone_by"],
            recent and row["undone_by"] is None and row["action"] in UNDOABLE,
        )


def record(
    db: Database,
    action: Action,
    category_id: str | None,
    before: Mapping[str, Any],
    after: Mapping[str, Any],
    actor: str | None,
    *,
    entry_id: str | None = None,
) -> str:
    """Adds an entry within a transaction; returns its id."""
    entry_id = entry_id or new_id()
    row = {"id": entry_id, "created_at": now(), "actor": actor, "action": action, "category_id": category_id}
    db.table("audit").insert(row | {"before": json.dumps(dict(before)), "after": json.dumps(dict(after))})
    return entry_id
