"""Categories and their references; changing what belongs together."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection
from pathlib import Path

import numpy as np
from sqlite_utils import Database

from core.encode import EncodedBurst
from core.errors import Conflict, InvalidInput, NotFound
from core.reference import Reference
from core.views import Burst, View
from store.arrays import arrays_file, read_arrays, write_arrays
from store.audit import record
from store.bursts import read_burst, read_view, require_view, write_burst
from store.columns import files_to_json
from store.connection import Connection, Row, new_id
from store.contents import files_of
from store.folders import Files
from store.instances import Instances, insert_instance
from store.overview import Listing, Order, Summary, listing, summary
from store.records import Category
from store.scans import OPEN
from store.times import now

SELECT = """
    SELECT c.*, (SELECT count(*) FROM instances i WHERE i.category_id = c.id AND i.removed_by IS NULL) AS instances
    FROM categories c WHERE c.removed_by IS NULL
"""
REFERENCE = "reference.npz"


class Categories:
    """The categories of one memory."""

    def __init__(self, connection: Connection, instances: Instances) -> None:
        self._connection = connection
        self._instances = instances
        self.root = connection.root / "categories"

    def create(
        self,
        reference: Reference,
        burst: Burst,
        encoded: EncodedBurst,
        *,
        name: str | None = None,
        scan_id: str | None = None,
        actor: str | None = None,
    ) -> Category:
        """A category in one atomic step: files, row, first instance, and the end of the scan that its views came from.

        Raises Conflict where that scan is gone or already made a category.
        """
        category_id = new_id()

        def insert(db: Database, files: Files) -> None:
            insert_category(db, category_id, reference, len(burst), files, name=name)
            insert_instance(db, category_id, encoded, source="scan", source_id=scan_id, how="scan")
            record(db, "create", category_id, {}, {"name": name, "views": len(burst)}, actor)
            if scan_id is not None:
                _finish_scan(db, scan_id, category_id)

        self._connection.create(self.folder(category_id), reference_files(reference, burst), insert, made=category_id)
        if scan_id is not None:
            self._connection.remove([self._connection.root / "scans" / scan_id])
        return self.get(category_id)

    def all(self) -> list[Category]:
        """All of them, oldest first."""
        return [_category(row) for row in self._connection.rows(f"{SELECT} ORDER BY c.rowid")]

    def names(self) -> dict[str, str | None]:
        """Of all of them, by id: every answer asks for these, and for nothing else of categories that it does not name."""
        return {row["id"]: row["name"] for row in self._connection.rows("SELECT id, name FROM categories WHERE removed_by IS NULL")}

    def listing(self, limit: int, offset: int = 0, *, order: Order = "name", called: str | None = None) -> Listing:
        """A page of those whose name has `called` in it, or whose id begins so, with what was seen of each."""
        return listing(self._connection, limit, offset, order=order, called=called)

    def get(self, category_id: str) -> Category:
        """Raises NotFound."""
        row = self._connection.row(f"{SELECT} AND c.id = ?", category_id)
        if row is None:
            raise NotFound(f"no category has the id {category_id!r}; GET /v1/categories lists them")
        return _category(row)

    def rename(self, category_id: str, name: str | None, *, actor: str | None = None) -> Category:
        """Raises NotFound."""
        with self._connection.change(category_id) as db:
            before = self.get(category_id).name
            db.execute("UPDATE categories SET name = ? WHERE id = ?", [name, category_id])
            record(db, "rename", category_id, {"name": before}, {"name": name}, actor)
        return self.get(category_id)

    def delete(self, category_id: str, *, actor: str | None = None) -> None:
        """Forgets it, its reference and its instances; they leave the disk once this can no longer be undone. Raises NotFound."""
        with self._connection.change(category_id) as db:
            category = self.get(category_id)
            entry_id = record(db, "delete", category_id, {"name": category.name, "instances": category.instances}, {}, actor)
            db.execute("UPDATE categories SET removed_by = ? WHERE id = ?", [entry_id, category_id])

    def merge(self, category_id: str, into_id: str, *, actor: str | None = None) -> Category:
        """Moves every burst of one category to another, which keeps its reference, name and goals. Raises NotFound, InvalidInput."""
        if category_id == into_id:
            raise InvalidInput("into", f"is the category itself, {category_id!r}; name another one")
        with self._connection.change(into_id) as db:
            name = self.get(category_id).name
            self.get(into_id)
            moved = [instance.id for instance in self._instances.of(category_id)]
            entry_id = record(db, "merge", category_id, {"name": name, "instances": moved}, {"into": into_id}, actor)
            move_instances(db, moved, category_id, into_id)
            db.execute("UPDATE categories SET removed_by = ? WHERE id = ?", [entry_id, category_id])
        return self.get(into_id)

    def split(
        self,
        category_id: str,
        instance_ids: Collection[str],
        reference: Reference,
        burst: Burst,
        *,
        name: str | None = None,
        actor: str | None = None,
    ) -> Category:
        """Moves some bursts of a category to a new one, whose reference was built from `burst`, the views of one of them.

        Raises NotFound for bursts that are not of the category, InvalidInput where none or all of them are named.
        """
        part_id = new_id()
        moved = list(dict.fromkeys(instance_ids))

        def insert(db: Database, files: Files) -> None:
            self._require_part(category_id, moved)
            insert_category(db, part_id, reference, len(burst), files, name=name)
            move_instances(db, moved, category_id, part_id)
            record(db, "split", category_id, {"instances": moved}, {"category": part_id, "name": name}, actor)

        self._require_part(category_id, moved)
        self._connection.create(self.folder(part_id), reference_files(reference, burst), insert, made=part_id)
        return self.get(part_id)

    def reference(self, category_id: str) -> Reference:
        """Raises NotFound, and Unavailable where its file is damaged."""
        name, file = arrays_file(self._files(category_id))
        return Reference.from_arrays(read_arrays(self.folder(category_id) / name, file.sha256))

    def summary(self, category_id: str) -> Summary:
        """One as `listing` has it. Raises NotFound."""
        return summary(self._connection, self.get(category_id).id)

    def burst(self, category_id: str) -> Burst:
        """All reference views. Raises NotFound, and Unavailable where one is damaged."""
        return read_burst(self.folder(category_id), self._files(category_id))

    def view(self, category_id: str, index: int) -> View:
        """One reference view. Raises NotFound, and Unavailable where it is damaged."""
        require_view(f"category {category_id!r}", self.get(category_id).views, index)
        return read_view(self.folder(category_id), self._files(category_id), index)

    def folder(self, category_id: str) -> Path:
        """Where its files are."""
        return self.root / category_id

    def _files(self, category_id: str) -> Files:
        return files_of(self._connection, f"categories/{self.get(category_id).id}")

    def _require_part(self, category_id: str, instance_ids: list[str]) -> None:
        self.get(category_id)
        known = {instance.id for instance in self._instances.of(category_id)}
        strange = [each for each in instance_ids if each not in known]
        if strange:
            raise NotFound(f"category {category_id!r} has no instance {strange[0]!r}")
        if not 0 < len(instance_ids) < len(known):
            raise InvalidInput(
                "instances", f"found {len(instance_ids)} of the category's {len(known)}; name at least one and not all of them"
            )


def reference_files(reference: Reference, burst: Burst) -> Callable[[Path], None]:
    """Writes what a category's folder holds."""

    def write(folder: Path) -> None:
        write_burst(folder, burst)
        write_arrays(folder / REFERENCE, reference.as_arrays())

    return write


def insert_category(
    db: Database,
    category_id: str,
    reference: Reference,
    views: int,
    files: Files,
    *,
    name: str | None,
    origin_id: str | None = None,
    created_at: str | None = None,
) -> None:
    """The row of a category, within a transaction; an imported one brings where and when it was learnt."""
    row = {
        "id": category_id,
        "name": name,
        "created_at": created_at or now(),
        "views": views,
        "origin_id": origin_id or category_id,
    }
    db.table("categories").insert(row | reference_columns(reference, files))


def reference_columns(reference: Reference, files: Files) -> Row:
    """The columns of a category that a backbone computed."""
    extent_m = json.dumps(np.asarray(reference.box.extent_m, dtype=float).tolist())
    return {"extent_m": extent_m, "reference_sha256": arrays_file(files)[1].sha256, "files": files_to_json(files)}


def move_instances(db: Database, instance_ids: Collection[str], category_id: str, into_id: str) -> int:
    """Those that are still of the first category become the other's; returns how many."""
    update = "UPDATE instances SET category_id = ? WHERE category_id = ? AND id IN (SELECT value FROM json_each(?))"
    return int(db.execute(update, [into_id, category_id, json.dumps(list(instance_ids))]).rowcount)


def _finish_scan(db: Database, scan_id: str, category_id: str) -> None:
    finished = db.execute(f"UPDATE scans SET state = 'completed', category_id = ? WHERE id = ? AND {OPEN}", [category_id, scan_id])
    if finished.rowcount != 1:
        raise Conflict(f"scan {scan_id!r} was completed, expired or deleted meanwhile; GET /v1/scans/{scan_id} says which")
    db.execute("DELETE FROM scan_bursts WHERE scan_id = ?", [scan_id])


def _category(row: Row) -> Category:
    return Category(
        row["id"],
        row["name"],
        row["created_at"],
        row["views"],
        row["instances"],
        tuple(json.loads(row["extent_m"])),
        row["origin_id"],
    )
