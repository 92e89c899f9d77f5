"""Observations: every burst that was looked at, what was answered, and what their pictures are drawn from."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from sqlite_utils import Database

from core.errors import NotFound
from core.novelty import Decision
from core.scan import ScanRequest
from core.views import Burst, View
from store.arrays import Array, read_arrays, write_arrays
from store.bursts import read_view, write_burst
from store.connection import Connection, Row, new_id, now, only
from store.records import Observation, Outcome, Pose, decision_from_json, decision_to_json, pose_from_json, pose_to_json
from store.scans import insert_scan

SELECT = "SELECT o.*, (SELECT s.id FROM scans s WHERE s.observation_id = o.id ORDER BY s.rowid LIMIT 1) AS scan_id FROM observations o"
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


class Observations:
    """The observations of one memory."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self.root = connection.root / "observations"

    def create(self, answer: Answer, burst: Burst, features: Mapping[str, Array], request: ScanRequest | None = None) -> Observation:
        """Keeps an observation, and begins the scan it asks for; `features` are plain arrays, opaque here."""
        observation_id = new_id()
        checksum: list[str] = []

        def write(folder: Path) -> None:
            write_burst(folder, burst)
            checksum.append(write_arrays(folder / FEATURES, features))

        def insert(db: Database) -> None:
            db.table("observations").insert(
                {
                    "id": observation_id,
                    "created_at": now(),
                    "outcome": answer.outcome,
                    "category_id": answer.category_id,
                    "frame": answer.frame,
                    "views": len(burst),
                    "decision": decision_to_json(answer.decision) if answer.decision else None,
                    "pose": pose_to_json(answer.pose) if answer.pose else None,
                    "pose_error": answer.pose_error,
                    "scan_error": answer.scan_error,
                    "timings_ms": json.dumps(dict(answer.timings_ms)),
                    "features_sha256": checksum[0],
                }
            )
            if request is not None:
                insert_scan(db, request, observation_id)

        self._connection.create(self.folder(observation_id), write, insert)
        return self.get(observation_id)

    def latest(self, limit: int) -> list[Observation]:
        """The latest ones, newest first."""
        return [_observation(row) for row in self._connection.rows(f"{SELECT} ORDER BY o.rowid DESC LIMIT ?", limit)]

    def get(self, observation_id: str) -> Observation:
        """Raises NotFound."""
        row = only(self._connection.rows(f"{SELECT} WHERE o.id = ?", observation_id))
        if row is None:
            raise NotFound(f"no observation has the id {observation_id!r}; GET /v1/observations lists them")
        return _observation(row)

    def view(self, observation_id: str, index: int) -> View:
        """One of its views. Raises NotFound."""
        observation = self.get(observation_id)
        if not 0 <= index < observation.views:
            raise NotFound(f"observation {observation_id!r} has the views 0 to {observation.views - 1}, not {index}")
        return read_view(self.folder(observation_id), index)

    def features(self, observation_id: str) -> dict[str, Array]:
        """The arrays it was kept with. Raises NotFound, and Unavailable where their file is damaged."""
        observation = self.get(observation_id)
        return read_arrays(self.folder(observation_id) / FEATURES, observation.features_sha256)

    def folder(self, observation_id: str) -> Path:
        """Where its files are."""
        return self.root / observation_id


def _observation(row: Row) -> Observation:
    return Observation(
        row["id"],
        row["created_at"],
        row["outcome"],
        row["category_id"],
        row["frame"],
        row["views"],
        decision_from_json(row["decision"]) if row["decision"] else None,
        pose_from_json(row["pose"]) if row["pose"] else None,
        row["pose_error"],
        row["scan_id"],
        row["scan_error"],
        json.loads(row["timings_ms"]),
        row["features_sha256"],
    )
