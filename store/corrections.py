"""What a person says an observation was of: its burst goes where they say, and that can be taken back like every change."""

from __future__ import annotations

from sqlite_utils import Database

from core.encode import EncodedBurst
from core.errors import Conflict, NotFound
from core.reference import Reference
from core.views import Burst
from store.audit import record
from store.categories import insert_category, reference_files
from store.connection import Connection, Row, new_id
from store.folders import Files
from store.instances import LIVING, insert_instance, is_empty
from store.observations import require_living
from store.records import AuditEntry

ASSIGNED = f"SELECT i.id, i.category_id, i.how, i.similarity {LIVING} AND i.source_id = ? AND i.observation_id IS NOT NULL"
"""The burst of an observation. Imported copies of it have its `source_id` too, but no observation."""


class Corrections:
    """Of one memory's observations."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def to_category(self, observation_id: str, category_id: str, encoded: EncodedBurst, *, actor: str | None = None) -> None:
        """It was of this category.

        Raises NotFound where the observation was dropped, Conflict where the category is gone, has the burst already, or where another one
        would be left without any.
        """
        with self._connection.change(observation_id) as db:
            require_living(db, category_id)
            _correct(db, observation_id, category_id, encoded, actor, made=False)

    def to_new(
        self,
        observation_id: str,
        reference: Reference,
        burst: Burst,
        encoded: EncodedBurst,
        *,
        name: str | None = None,
        actor: str | None = None,
    ) -> str:
        """It was of no category so far: its views make one, whose id this returns. Raises as `to_category` does."""
        category_id = new_id()

        def insert(db: Database, files: Files) -> None:
            insert_category(db, category_id, reference, len(burst), files, name=name)
            _correct(db, observation_id, category_id, encoded, actor, made=True)

        folder = self._connection.root / "categories" / category_id
        self._connection.create(folder, reference_files(reference, burst), insert, made=observation_id)
        return category_id


def _correct(db: Database, observation_id: str, category_id: str, encoded: EncodedBurst, actor: str | None, *, made: bool) -> None:
    seen = db.execute("SELECT corrected_to FROM observations WHERE id = ?", [observation_id]).fetchone()
    if seen is None:
        raise NotFound(f"observation {observation_id!r} was dropped meanwhile, as one of the oldest")
    assigned: Row | None = next(iter(db.query(ASSIGNED, [observation_id])), None)
    if assigned is None:
        instance_id = insert_instance(db, category_id, encoded, source="observation", source_id=observation_id, how="named")
    else:
        instance_id = assigned["id"]
        if assigned["category_id"] == category_id:
            raise Conflict(f"observation {observation_id!r} is one of category {category_id!r} already")
        update = "UPDATE instances SET category_id = ?, how = 'named', similarity = NULL WHERE id = ?"
        db.execute(update, [category_id, instance_id])
        if is_empty(db, assigned["category_id"]):
            raise Conflict(f"the burst is the last of category {assigned['category_id']!r}; merge or delete that category instead")
    db.execute("UPDATE observations SET corrected_to = ? WHERE id = ?", [category_id, observation_id])
    before = {"assigned": assigned, "corrected_to": seen[0]}
    after = {"observation": observation_id, "category": category_id, "instance": instance_id, "made": made}
    record(db, "correct", category_id, before, after, actor)


def undo_correction(db: Database, entry: AuditEntry, undo_id: str) -> bool:
    """Takes one back; a category that it made goes into the bin. Returns whether things were as the correction left them."""
    before, after = entry.before, entry.after
    assigned = before["assigned"]
    here = "id = ? AND category_id = ? AND removed_by IS NULL"
    if assigned is None:
        back = db.execute(f"UPDATE instances SET removed_by = ? WHERE {here}", [undo_id, after["instance"], after["category"]])
    else:
        living = "? IN (SELECT id FROM categories WHERE removed_by IS NULL)"
        home = assigned["category_id"]
        restored = [home, assigned["how"], assigned["similarity"], after["instance"], after["category"], home]
        back = db.execute(f"UPDATE instances SET category_id = ?, how = ?, similarity = ? WHERE {here} AND {living}", restored)
    if not back.rowcount:
        return False
    if after["made"]:
        empty = "NOT EXISTS (SELECT 1 FROM instances i WHERE i.category_id = categories.id AND i.removed_by IS NULL)"
        into_bin = f"UPDATE categories SET removed_by = ? WHERE id = ? AND removed_by IS NULL AND {empty}"
        if not db.execute(into_bin, [undo_id, after["category"]]).rowcount:
            return False
    elif is_empty(db, after["category"]):
        return False
    as_left = "UPDATE observations SET corrected_to = ? WHERE id = ? AND corrected_to = ?"  # one corrected since stays where it is
    db.execute(as_left, [before["corrected_to"], after["observation"], after["category"]])
    return True
