"""Taking back a change of what was learnt, as long as nothing later rests on it."""

from __future__ import annotations

from collections.abc import Callable

from sqlite_utils import Database

from core.errors import Conflict
from store.audit import UNDOABLE, record
from store.categories import move_instances
from store.connection import Connection, new_id
from store.corrections import undo_correction
from store.instances import is_empty
from store.records import Action, AuditEntry

ELSEWHERE = """
    SELECT later.rowid, later.id, i.source_id, i.id FROM audit later
    CROSS JOIN instances i ON i.source = 'observation' AND i.source_id = json_extract(later.after, '$.observation')
    JOIN categories c ON c.id = i.category_id
    WHERE later.rowid > (SELECT rowid FROM audit WHERE id = ?) AND later.action = 'correct' AND later.undone_by IS NULL
    AND i.id != json_extract(later.after, '$.instance') AND i.removed_by IS NULL AND c.removed_by IS NULL
    AND (i.observation_id IS NOT NULL OR NOT EXISTS (SELECT 1 FROM observations o WHERE o.id = i.source_id))
"""
"""Living bursts of observations that a correction after a change put elsewhere, as bursts of their own. The corrections are few, and come
first by `CROSS JOIN`; an imported copy has no observation."""


def undo(connection: Connection, entry: AuditEntry, actor: str | None) -> str:
    """Takes one change back and returns the id of the entry that says so.

    Raises Conflict where it is undone already, too long ago, of a kind that cannot be undone, or changed again since; also where it would
    bring back a burst whose observation was corrected since: to where a person said that it is not, or to two categories at once.
    """
    if not entry.undoable:
        raise Conflict(f"change {entry.id!r} cannot be undone: {_why_not(connection, entry)}")
    undo_id = new_id()
    with connection.change(undo_id) as db:
        elsewhere = _elsewhere(db, entry)
        record(db, "undo", entry.category_id, {"entry": entry.id, "action": entry.action}, {}, actor, entry_id=undo_id)
        first = db.execute("UPDATE audit SET undone_by = ? WHERE id = ? AND undone_by IS NULL", [undo_id, entry.id])
        if first.rowcount != 1 or not REVERSE[entry.action](db, entry, undo_id):
            raise Conflict(f"change {entry.id!r} cannot be undone: what it changed was changed again since; undo the later change first")
        if back := _elsewhere(db, entry) - elsewhere:
            _, correction, observation, _ = max(back)
            since = f"observation {observation!r} was corrected since, by change {correction!r}"
            raise Conflict(f"change {entry.id!r} cannot be undone: {since}; undo the later change first")
    return undo_id


def _elsewhere(db: Database, entry: AuditEntry) -> set[tuple[int, str, str, str]]:
    """Corrections by age, their observations, and bursts of these that live beside what was corrected.

    Compared before and after an undo: imported copies of a burst share its `source_id`, and live beside it with good reason.
    """
    return set(db.execute(ELSEWHERE, [entry.id]).fetchall())


def _why_not(connection: Connection, entry: AuditEntry) -> str:
    if entry.undone_by is not None:
        return "it is undone already"
    if entry.action not in UNDOABLE:
        return f"only {', '.join(UNDOABLE)} can be, this is of the kind {entry.action}"
    return f"it is older than {connection.retention.undo}"


def _rename(db: Database, entry: AuditEntry, undo_id: str) -> bool:
    update = "UPDATE categories SET name = ? WHERE id = ? AND name IS ? AND removed_by IS NULL"
    return bool(db.execute(update, [entry.before["name"], entry.category_id, entry.after["name"]]).rowcount)


def _delete(db: Database, entry: AuditEntry, undo_id: str) -> bool:
    return bool(db.execute("UPDATE categories SET removed_by = NULL WHERE removed_by = ?", [entry.id]).rowcount)


def _forget(db: Database, entry: AuditEntry, undo_id: str) -> bool:
    living = "category_id IN (SELECT id FROM categories WHERE removed_by IS NULL)"
    return bool(db.execute(f"UPDATE instances SET removed_by = NULL WHERE removed_by = ? AND {living}", [entry.id]).rowcount)


def _merge(db: Database, entry: AuditEntry, undo_id: str) -> bool:
    assert entry.category_id is not None
    into = entry.after["into"]
    back = move_instances(db, entry.before["instances"], into, entry.category_id)
    return _delete(db, entry, undo_id) and back > 0 and not is_empty(db, into)


def _split(db: Database, entry: AuditEntry, undo_id: str) -> bool:
    """The part goes into the bin; every burst that it has by now returns, so that none is lost."""
    part_id = entry.after["category"]
    part = db.execute("UPDATE categories SET removed_by = ? WHERE id = ? AND removed_by IS NULL", [undo_id, part_id])
    living = "? IN (SELECT id FROM categories WHERE removed_by IS NULL)"
    back = f"UPDATE instances SET category_id = ? WHERE category_id = ? AND {living}"
    return bool(part.rowcount and db.execute(back, [entry.category_id, part_id, entry.category_id]).rowcount)


REVERSE: dict[Action, Callable[[Database, AuditEntry, str], bool]] = {
    "rename": _rename,
    "delete": _delete,
    "forget": _forget,
    "merge": _merge,
    "split": _split,
    "correct": undo_correction,
}
"""Each returns whether things were as the change left them."""
