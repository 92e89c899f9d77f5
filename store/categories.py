"""Categories, their references and the bursts assigned to them.

Letters: V views, D token size.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from sqlite_utils import Database

from core.encode import EncodedBurst
from core.errors import Conflict, NotFound
from core.novelty import Member
from core.reference import Reference
from core.views import Burst, View
from store.arrays import from_blob, read_arrays, to_blob, write_arrays
from store.bursts import read_view, rgb_file, write_burst
from store.connection import Connection, Row, new_id, now, only
from store.records import Category

SELECT = "SELECT c.*, (SELECT count(*) FROM instances i WHERE i.category_id = c.id) AS instances FROM categories c"
REFERENCE = "reference.npz"


class Categories:
    """The categories of one memory."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self.root = connection.root / "categories"

    def create(
        self, reference: Reference, burst: Burst, encoded: EncodedBurst, *, name: str | None = None, scan_id: str | None = None
    ) -> Category:
        """A category in one atomic step: files, row, first instance, and the end of the scan that its views came from.

        Raises Conflict where that scan is gone or already made a category.
        """
        category_id = new_id()
        extent_m = json.dumps(np.asarray(reference.box.extent_m, dtype=float).tolist())
        checksum: list[str] = []

        def write(folder: Path) -> None:
            write_burst(folder, burst)
            checksum.append(write_arrays(folder / REFERENCE, reference.as_arrays()))

        def insert(db: Database) -> None:
            row = {
                "id": category_id,
                "name": name,
                "created_at": now(),
                "views": len(burst),
                "extent_m": extent_m,
                "reference_sha256": checksum[0],
            }
            db.table("categories").insert(row)
            _insert_instance(db, category_id, encoded.cls, encoded.pooled, "scan")
            if scan_id is not None:
                _finish_scan(db, scan_id, category_id)

        self._connection.create(self.folder(category_id), write, insert)
        if scan_id is not None:
            shutil.rmtree(self._connection.root / "scans" / scan_id, ignore_errors=True)
        return self.get(category_id)

    def all(self) -> list[Category]:
        """All of them, oldest first."""
        return [_category(row) for row in self._connection.rows(f"{SELECT} ORDER BY c.rowid")]

    def get(self, category_id: str) -> Category:
        """Raises NotFound."""
        row = only(self._connection.rows(f"{SELECT} WHERE c.id = ?", category_id))
        if row is None:
            raise NotFound(f"no category has the id {category_id!r}; GET /v1/categories lists them")
        return _category(row)

    def rename(self, category_id: str, name: str | None) -> Category:
        """Raises NotFound."""
        self.get(category_id)
        with self._connection.change() as db:
            db.execute("UPDATE categories SET name = ? WHERE id = ?", [name, category_id])
        return self.get(category_id)

    def delete(self, category_id: str) -> None:
        """Forgets it, its reference and its instances. Raises NotFound."""
        self.get(category_id)
        self._connection.remove(self.folder(category_id), lambda db: db.table("categories").delete_where("id = ?", [category_id]))

    def reference(self, category_id: str) -> Reference:
        """Raises NotFound, and Unavailable where its file is damaged."""
        category = self.get(category_id)
        return Reference.from_arrays(read_arrays(self.folder(category_id) / REFERENCE, category.reference_sha256))

    def view(self, category_id: str, index: int) -> View:
        """One reference view. Raises NotFound."""
        self._require_view(category_id, index)
        return read_view(self.folder(category_id), index)

    def rgb_file(self, category_id: str, index: int) -> Path:
        """The colour image of one reference view. Raises NotFound."""
        self._require_view(category_id, index)
        return rgb_file(self.folder(category_id), index)

    def assign(self, category_id: str, encoded: EncodedBurst, observation_id: str) -> None:
        """Adds the burst of an observation to a category. Raises NotFound."""
        self.get(category_id)
        with self._connection.change() as db:
            _insert_instance(db, category_id, encoded.cls, encoded.pooled, "observation", observation_id)

    def members(self) -> list[Member]:
        """Every burst assigned to a category, oldest first."""
        rows = self._connection.rows("SELECT category_id, views, cls, pooled FROM instances ORDER BY rowid")
        return [Member(row["category_id"], from_blob(row["cls"], row["views"]), from_blob(row["pooled"], row["views"])) for row in rows]

    def folder(self, category_id: str) -> Path:
        """Where its files are."""
        return self.root / category_id

    def _require_view(self, category_id: str, index: int) -> None:
        category = self.get(category_id)
        if not 0 <= index < category.views:
            raise NotFound(f"category {category_id!r} has the views 0 to {category.views - 1}, not {index}")


def _insert_instance(
    db: Database,
    category_id: str,
    cls: NDArray[np.floating],
    pooled: NDArray[np.floating],
    source: Literal["scan", "observation"],
    observation_id: str | None = None,
) -> None:
    row = {"id": new_id(), "category_id": category_id, "created_at": now(), "source": source, "observation_id": observation_id}
    db.table("instances").insert(row | {"views": len(cls), "cls": to_blob(cls), "pooled": to_blob(pooled)})


def _finish_scan(db: Database, scan_id: str, category_id: str) -> None:
    done = db.execute("UPDATE scans SET state = 'completed', category_id = ? WHERE id = ? AND state != 'completed'", [category_id, scan_id])
    if done.rowcount != 1:
        raise Conflict(f"scan {scan_id!r} was completed or deleted meanwhile; GET /v1/scans/{scan_id} says which")
    db.execute("DELETE FROM scan_bursts WHERE scan_id = ?", [scan_id])


def _category(row: Row) -> Category:
    return Category(
        row["id"],
        row["name"],
        row["created_at"],
        row["views"],
        row["instances"],
        tuple(json.loads(row["extent_m"])),
        row["reference_sha256"],
    )
