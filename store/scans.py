"""Scans in progress: what was asked for, and the views that came. They outlive the process that asked."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from sqlite_utils import Database

from core.errors import Conflict, NotFound
from core.scan import ScanRequest
from core.views import Burst
from store.bursts import read_burst, write_burst
from store.columns import files_from_json, files_to_json, request_from_json, request_to_json
from store.connection import Connection, Row, new_id
from store.folders import Files
from store.records import Scan, ScanState
from store.times import ahead, now

SELECT = """
    SELECT s.id, s.created_at, s.state, s.request, s.observation_id, c.id AS category_id, s.expires_at,
    (SELECT coalesce(sum(b.views), 0) FROM scan_bursts b WHERE b.scan_id = s.id) AS views
    FROM scans s LEFT JOIN categories c ON c.id = s.category_id AND c.removed_by IS NULL
"""
OPEN_STATES: tuple[ScanState, ...] = ("requested", "collecting")
"""Views may still come."""
OPEN = f"state IN {OPEN_STATES}"
IN_PROGRESS = f"{OPEN} AND expires_at > ?"
"""Of `now`: a scan whose time is over is expired, also while its row does not say so yet."""


class Scans:
    """The scans of one memory."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self.root = connection.root / "scans"

    def create(self, request: ScanRequest, observation_id: str | None = None) -> Scan:
        """A scan without views yet."""
        scan_id = new_id()
        with self._connection.change(scan_id) as db:
            insert_scan(db, scan_id, request, observation_id, self._expiry())
        return self.get(scan_id)

    def get(self, scan_id: str) -> Scan:
        """Raises NotFound."""
        row = self._connection.row(f"{SELECT} WHERE s.id = ?", scan_id)
        if row is None:
            raise NotFound(f"no scan has the id {scan_id!r}; POST /v1/scans begins one")
        return _scan(row)

    def in_progress(self, limit: int) -> list[Scan]:
        """Those that views may still come for, the latest begun first."""
        rows = self._connection.rows(f"{SELECT} WHERE {IN_PROGRESS} ORDER BY s.rowid DESC LIMIT ?", now(), limit)
        return [_scan(row) for row in rows]

    def states(self) -> dict[str, int]:
        """How many scans are in each state; none where a state is left out."""
        state = f"CASE WHEN {OPEN} AND expires_at <= ? THEN 'expired' ELSE state END"
        rows = self._connection.rows(f"SELECT {state} AS state, count(*) AS n FROM scans GROUP BY 1", now())
        return {row["state"]: row["n"] for row in rows}

    def require_open(self, scan_id: str) -> Scan:
        """Raises NotFound, and Conflict where it is completed or expired."""
        scan = self.get(scan_id)
        if scan.state == "completed":
            made = f"made category {scan.category_id!r}" if scan.category_id else "made a category that was deleted since"
            raise Conflict(f"scan {scan_id!r} is completed and {made}; begin another with POST /v1/scans")
        if scan.state == "expired":
            raise Conflict(f"scan {scan_id!r} expired at {scan.expires_at}, since no views came; begin another with POST /v1/scans")
        return scan

    def replace_request(self, scan_id: str, request: ScanRequest) -> Scan:
        """Asks for other viewpoints than before. Raises NotFound and Conflict."""
        with self._connection.change(scan_id) as db:
            self.require_open(scan_id)
            db.execute("UPDATE scans SET request = ? WHERE id = ?", [request_to_json(request), scan_id])
        return self.get(scan_id)

    def add(self, scan_id: str, burst: Burst, report: Any = None) -> Scan:
        """Keeps the views of `burst`, and what the caller has to say of them as JSON, opaque here. Raises NotFound and Conflict."""
        self.require_open(scan_id)
        burst_id = new_id()

        def insert(db: Database, files: Files) -> None:
            self.require_open(scan_id)
            row = {"id": burst_id, "scan_id": scan_id, "created_at": now(), "views": len(burst)}
            db.execute("UPDATE scans SET state = 'collecting', expires_at = ? WHERE id = ?", [self._expiry(), scan_id])
            db.table("scan_bursts").insert(row | {"files": files_to_json(files), "report": json.dumps(report)})

        folder = self.root / scan_id / burst_id
        self._connection.create(folder, lambda partial: write_burst(partial, burst), insert, made=scan_id)
        return self.get(scan_id)

    def reports(self, scan_id: str) -> list[Any]:
        """What was said of each burst received, oldest first. Raises NotFound."""
        self.get(scan_id)
        rows = self._connection.rows("SELECT report FROM scan_bursts WHERE scan_id = ? ORDER BY rowid", scan_id)
        return [json.loads(row["report"] or "null") for row in rows]

    def burst(self, scan_id: str) -> Burst | None:
        """All views received so far as one burst, None before the first. Raises NotFound, and Unavailable where one is damaged."""
        views = [view for folder, files in self._folders(scan_id) for view in read_burst(folder, files).views]
        return Burst(views) if views else None

    def delete(self, scan_id: str) -> None:
        """Forgets it and its views; the category of a completed one stays. Raises NotFound."""
        with self._connection.change(scan_id) as db:
            self.get(scan_id)
            db.execute("DELETE FROM scans WHERE id = ?", [scan_id])
        self._connection.remove([self.folder(scan_id)])

    def expire(self) -> None:
        """Drops the views of scans whose time is over; that they were asked for is kept."""
        over = self._connection.rows(f"SELECT id FROM scans WHERE {OPEN} AND expires_at <= ?", now())
        for row in over:
            with self._connection.change() as db:
                db.execute(f"UPDATE scans SET state = 'expired' WHERE id = ? AND {OPEN}", [row["id"]])  # it may be completed by now
                db.execute("DELETE FROM scan_bursts WHERE scan_id = ?", [row["id"]])
            self._connection.remove([self.folder(row["id"])])

    def folder(self, scan_id: str) -> Path:
        """Where its views are."""
        return self.root / scan_id

    def _folders(self, scan_id: str) -> list[tuple[Path, Files]]:
        """Of the bursts received, oldest first. Raises NotFound."""
        self.get(scan_id)
        rows = self._connection.rows("SELECT id, files FROM scan_bursts WHERE scan_id = ? ORDER BY rowid", scan_id)
        return [(self.root / scan_id / row["id"], files_from_json(row["files"])) for row in rows]

    def _expiry(self) -> str:
        return ahead(self._connection.retention.scans)


def insert_scan(db: Database, scan_id: str, request: ScanRequest, observation_id: str | None, expires_at: str) -> None:
    """The row of a scan without views, within a transaction."""
    db.table("scans").insert(
        {
            "id": scan_id,
            "created_at": now(),
            "state": "requested",
            "request": request_to_json(request),
            "observation_id": observation_id,
            "expires_at": expires_at,
        }
    )


def _scan(row: Row) -> Scan:
    return Scan(
        row["id"],
        row["created_at"],
        "expired" if row["state"] in OPEN_STATES and row["expires_at"] <= now() else row["state"],
        request_from_json(row["request"]),
        row["views"],
        row["observation_id"],
        row["category_id"],
        row["expires_at"],
    )
