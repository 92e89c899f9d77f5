"""Scans in progress: what was asked for, and the views that came. They outlive the process that asked."""

from __future__ import annotations

from pathlib import Path

from sqlite_utils import Database

from core.errors import Conflict, NotFound
from core.scan import ScanRequest
from core.views import Burst
from store.bursts import read_burst, write_burst
from store.connection import Connection, Row, new_id, now, only
from store.records import Scan, request_from_json, request_to_json

SELECT = "SELECT s.*, (SELECT coalesce(sum(b.views), 0) FROM scan_bursts b WHERE b.scan_id = s.id) AS views FROM scans s"


class Scans:
    """The scans of one memory."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self.root = connection.root / "scans"

    def create(self, request: ScanRequest, observation_id: str | None = None) -> Scan:
        """A scan without views yet."""
        with self._connection.change() as db:
            scan_id = insert_scan(db, request, observation_id)
        return self.get(scan_id)

    def get(self, scan_id: str) -> Scan:
        """Raises NotFound."""
        row = only(self._connection.rows(f"{SELECT} WHERE s.id = ?", scan_id))
        if row is None:
            raise NotFound(f"no scan has the id {scan_id!r}; POST /v1/scans begins one")
        return _scan(row)

    def require_open(self, scan_id: str) -> Scan:
        """Raises NotFound, and Conflict where it is completed."""
        scan = self.get(scan_id)
        if scan.state == "completed":
            made = f"made category {scan.category_id!r}" if scan.category_id else "made a category that was deleted since"
            raise Conflict(f"scan {scan_id!r} is completed and {made}; begin another with POST /v1/scans")
        return scan

    def add(self, scan_id: str, burst: Burst) -> Scan:
        """Keeps the views of `burst`. Raises NotFound and Conflict."""
        self.require_open(scan_id)
        burst_id = new_id()

        def insert(db: Database) -> None:
            row = {"id": burst_id, "scan_id": scan_id, "created_at": now(), "views": len(burst)}
            still_open = db.execute("UPDATE scans SET state = 'collecting' WHERE id = ? AND state != 'completed'", [scan_id])
            if still_open.rowcount != 1:
                raise Conflict(f"scan {scan_id!r} was completed or deleted meanwhile")
            db.table("scan_bursts").insert(row)

        self._connection.create(self.root / scan_id / burst_id, lambda folder: write_burst(folder, burst), insert)
        return self.get(scan_id)

    def burst(self, scan_id: str) -> Burst | None:
        """All views received so far as one burst, None before the first. Raises NotFound."""
        self.get(scan_id)
        folders = [self.root / scan_id / burst_id for burst_id in self.burst_ids(scan_id)]
        views = [view for folder in folders for view in read_burst(folder).views]
        return Burst(views) if views else None

    def burst_ids(self, scan_id: str) -> list[str]:
        """The bursts received, oldest first."""
        return [row["id"] for row in self._connection.rows("SELECT id FROM scan_bursts WHERE scan_id = ? ORDER BY rowid", scan_id)]

    def delete(self, scan_id: str) -> None:
        """Forgets it and its views; the category of a completed one stays. Raises NotFound."""
        self.get(scan_id)
        self._connection.remove(self.folder(scan_id), lambda db: db.table("scans").delete_where("id = ?", [scan_id]))

    def folder(self, scan_id: str) -> Path:
        """Where its views are."""
        return self.root / scan_id


def insert_scan(db: Database, request: ScanRequest, observation_id: str | None) -> str:
    """The row of a scan without views, within a transaction; returns its id."""
    scan_id = new_id()
    row = {"id": scan_id, "created_at": now(), "state": "requested", "request": request_to_json(request), "observation_id": observation_id}
    db.table("scans").insert(row)
    return scan_id


def _scan(row: Row) -> Scan:
    return Scan(
        row["id"],
        row["created_at"],
        row["state"],
        request_from_json(row["request"]),
        row["views"],
        row["observation_id"],
        row["category_id"],
    )
