"""Observations: every burst that was looked at, what was answered, and what their pictures are drawn from."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from sqlite_utils import Database

from core.encode import EncodedBurst
from core.errors import Conflict, NotFound
from core.grounds import Grounds
from core.novelty import Decision, Outcome
from core.scan import ScanRequest
from core.views import Burst, View
from store.arrays import Array, arrays_file, read_arrays, write_arrays
from store.bursts import read_burst, read_view, require_view, write_burst
from store.columns import (
    decision_from_json,
    decision_to_json,
    files_to_json,
    grounds_from_json,
    grounds_to_json,
    pose_from_json,
    pose_to_json,
)
from store.connection import Connection, Row, new_id
from store.contents import files_of
from store.folders import Files
from store.instances import insert_instance
from store.records import Assignment, Observation, Pose
from store.scans import insert_scan
from store.times import ahead, now

SELECT = """
    SELECT o.*, c.id AS living_category_id, k.id AS living_corrected_to,
    (SELECT s.id FROM scans s WHERE s.observation_id = o.id ORDER BY s.rowid LIMIT 1) AS scan_id
    FROM observations o LEFT JOIN categories c ON c.id = o.category_id AND c.removed_by IS NULL
    LEFT JOIN categories k ON k.id = o.corrected_to AND k.removed_by IS NULL
"""
OVER = "SELECT id FROM observations ORDER BY rowid DESC LIMIT -1 OFFSET ?"
"""All but the latest so many."""
FEATURES = "features.npz"


@dataclass(frozen=True, eq=False)
class Answer:
    """What is kept of an observation."""

    outcome: Outcome
    category_id: str | None
    frame: str | None
    decision: Decision | None
    pose: Pose | None
    pose_error: str | None
    scan_error: str | None
    timings_ms: Mapping[str, float]
    grounds: Grounds | None = None
    viewpoints: Array | None = None
    """Of an uncertain object where to look next, world_from_camera, shape (n, 4, 4)."""


@dataclass(frozen=True, eq=False)
class Joins:
    """That the burst becomes an instance of a category."""

    category_id: str
    encoded: EncodedBurst
    similarity: float | None
    how: Assignment


class Observations:
    """The observations of one memory, at most as many as its retention says."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self.root = connection.root / "observations"

    def create(
        self,
        answer: Answer,
        burst: Burst,
        features: Mapping[str, Array],
        request: ScanRequest | None = None,
        *,
        joins: Joins | None = None,
    ) -> Observation:
        """Keeps an observation, and in the same step begins the scan it asks for, assigns it to a category, and drops the oldest.

        `features` are plain arrays, opaque here. Raises Conflict where the category is gone.
        """
        observation_id = new_id()
        dropped: list[str] = []

        def write(folder: Path) -> None:
            write_burst(folder, burst)
            write_arrays(folder / FEATURES, features)

        def insert(db: Database, files: Files) -> None:
            db.table("observations").insert(_row(observation_id, answer, len(burst), files))
            if request is not None:
                insert_scan(db, new_id(), request, observation_id, ahead(self._connection.retention.scans))
            if joins is not None:
                require_living(db, joins.category_id)
                insert_instance(
                    db,
                    joins.category_id,
                    joins.encoded,
                    source="observation",
                    source_id=observation_id,
                    how=joins.how,
                    similarity=joins.similarity,
                )
            dropped.extend(self._drop_oldest(db))

        self._connection.create(self.folder(observation_id), write, insert, made=observation_id)
        self._connection.remove([self.folder(each) for each in dropped])
        return self.get(observation_id)

    def latest(
        self, limit: int, *, before: str | None = None, category_id: str | None = None, outcome: Outcome | None = None
    ) -> list[Observation]:
        """The latest ones, newest first: those before an observation, recognised as a category, or with an outcome where that is given.

        Raises NotFound for an unknown observation.
        """
        wanted: dict[str, object] = {}
        if before is not None:
            wanted["o.rowid < (SELECT rowid FROM observations WHERE id = ?)"] = self.get(before).id
        if category_id is not None:
            wanted["c.id = ?"] = category_id
        if outcome is not None:
            wanted["o.outcome = ?"] = outcome
        where = " AND ".join(wanted) or "TRUE"
        rows = self._connection.rows(f"{SELECT} WHERE {where} ORDER BY o.rowid DESC LIMIT ?", *wanted.values(), limit)
        return [_observation(row) for row in rows]

    def decisions(self, limit: int) -> list[Decision]:
        """The latest decisions, newest first; what a person corrected counts as they said."""
        latest = "SELECT decision, corrected_to FROM observations WHERE decision IS NOT NULL ORDER BY rowid DESC LIMIT ?"
        found = [(decision_from_json(row["decision"]), row["corrected_to"]) for row in self._connection.rows(latest, limit)]
        return [decision if said is None else decision.corrected(said) for decision, said in found]

    def get(self, observation_id: str) -> Observation:
        """Raises NotFound."""
        row = self._connection.row(f"{SELECT} WHERE o.id = ?", observation_id)
        if row is None:
            raise NotFound(f"no observation has the id {observation_id!r}; GET /v1/observations lists them")
        return _observation(row)

    def view(self, observation_id: str, index: int) -> View:
        """One of its views. Raises NotFound, and Unavailable where it is damaged."""
        require_view(f"observation {observation_id!r}", self.get(observation_id).views, index)
        return read_view(self.folder(observation_id), self._files(observation_id), index)

    def burst(self, observation_id: str) -> Burst:
        """All its views. Raises NotFound, and Unavailable where one is damaged."""
        return read_burst(self.folder(observation_id), self._files(observation_id))

    def features(self, observation_id: str) -> dict[str, Array]:
        """The arrays it was kept with. Raises NotFound, and Unavailable where their file is damaged."""
        name, file = arrays_file(self._files(observation_id))
        return read_arrays(self.folder(observation_id) / name, file.sha256)

    def folder(self, observation_id: str) -> Path:
        """Where its files are."""
        return self.root / observation_id

    def prune(self) -> None:
        """Drops what is more than the retention allows, which may have become less since."""
        if not self._connection.rows(OVER, self._connection.retention.observations):
            return
        with self._connection.change() as db:
            dropped = self._drop_oldest(db)
        self._connection.remove([self.folder(each) for each in dropped])

    def _files(self, observation_id: str) -> Files:
        return files_of(self._connection, f"observations/{self.get(observation_id).id}")

    def _drop_oldest(self, db: Database) -> list[str]:
        """Within a transaction; returns which, whose folders go once it is committed."""
        dropped = [row["id"] for row in db.query(OVER, [self._connection.retention.observations])]
        for each in dropped:
            db.execute("UPDATE instances SET pictures = NULL WHERE pictures = ?", [f"observations/{each}"])
            db.execute("DELETE FROM observations WHERE id = ?", [each])
        return dropped


def require_living(db: Database, category_id: str) -> None:
    """Raises Conflict for a category that is gone, or that was deleted or merged and could still be brought back."""
    if db.execute("SELECT 1 FROM categories WHERE id = ? AND removed_by IS NULL", [category_id]).fetchone() is None:
        raise Conflict(f"category {category_id!r} was deleted or merged meanwhile; send the request again")


def _row(observation_id: str, answer: Answer, views: int, files: Files) -> Row:
    return {
        "id": observation_id,
        "created_at": now(),
        "outcome": answer.outcome,
        "category_id": answer.category_id,
        "frame": answer.frame,
        "views": views,
        "decision": decision_to_json(answer.decision) if answer.decision else None,
        "pose": pose_to_json(answer.pose) if answer.pose else None,
        "pose_error": answer.pose_error,
        "scan_error": answer.scan_error,
        "timings_ms": json.dumps(dict(answer.timings_ms)),
        "viewpoints": None if answer.viewpoints is None else json.dumps(answer.viewpoints.tolist()),
        "features_sha256": arrays_file(files)[1].sha256,
        "files": files_to_json(files),
        "grounds": grounds_to_json(answer.grounds) if answer.grounds else None,
    }


def _observation(row: Row) -> Observation:
    return Observation(
        row["id"],
        row["created_at"],
        row["outcome"],
        row["living_category_id"],
        row["frame"],
        row["views"],
        decision_from_json(row["decision"]) if row["decision"] else None,
        pose_from_json(row["pose"]) if row["pose"] else None,
        row["pose_error"],
        row["scan_id"],
        row["scan_error"],
        json.loads(row["timings_ms"]),
        grounds_from_json(row["grounds"]) if row["grounds"] else None,
        np.array(json.loads(row["viewpoints"])).reshape(-1, 4, 4) if row["viewpoints"] else None,
        row["living_corrected_to"],
    )
