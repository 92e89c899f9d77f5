"""The database's tables, as a growing list of migrations: a released one is never edited, a change is a new one."""

from __future__ import annotations

from sqlite_utils import Database, Migrations
from sqlite_utils.db import ForeignKey

from core.errors import Conflict

migrations = Migrations("onelook")


def upgrade(db: Database) -> None:
    """Brings `db` to this version's tables. Raises Conflict for a database that a later version made."""
    with Database(memory=True) as empty:
        known = {migration.name for migration in migrations.pending(empty)}
    later = sorted({migration.name for migration in migrations.applied(db)} - known)
    if later:
        raise Conflict(
            f"the memory was made by a later version of OneLook (steps unknown here: {', '.join(later)}); upgrade onelook to open it"
        )
    migrations.apply(db)


@migrations()
def m001_tables(db: Database) -> None:
    """Everything the first version keeps."""
    db.table("meta").create({"key": str, "value": str}, pk="key", not_null={"value"})
    db.table("meta").insert({"key": "memory_version", "value": "0"})
    db.table("categories").create(
        {"id": str, "name": str, "created_at": str, "views": int, "extent_m": str, "reference_sha256": str},
        pk="id",
        not_null={"created_at", "views", "extent_m", "reference_sha256"},
    )
    db.table("observations").create(
        {
            "id": str,
            "created_at": str,
            "outcome": str,
            "category_id": str,
            "frame": str,
            "views": int,
            "decision": str,
            "pose": str,
            "pose_error": str,
            "scan_error": str,
            "timings_ms": str,
            "features_sha256": str,
        },
        pk="id",
        not_null={"created_at", "outcome", "views", "timings_ms", "features_sha256"},
        foreign_keys=[_reference("observations", "category_id", "categories", "SET NULL")],
    )
    db.table("scans").create(
        {"id": str, "created_at": str, "state": str, "request": str, "observation_id": str, "category_id": str},
        pk="id",
        not_null={"created_at", "state", "request"},
        foreign_keys=[
            _reference("scans", "observation_id", "observations", "SET NULL"),
            _reference("scans", "category_id", "categories", "SET NULL"),
        ],
    )
    db.table("scan_bursts").create(
        {"id": str, "scan_id": str, "created_at": str, "views": int},
        pk="id",
        not_null={"scan_id", "created_at", "views"},
        foreign_keys=[_reference("scan_bursts", "scan_id", "scans", "CASCADE")],
    )
    db.table("instances").create(
        {
            "id": str,
            "category_id": str,
            "created_at": str,
            "source": str,
            "observation_id": str,
            "views": int,
            "cls": bytes,
            "pooled": bytes,
        },
        pk="id",
        not_null={"category_id", "created_at", "source", "views", "cls", "pooled"},
        foreign_keys=[
            _reference("instances", "category_id", "categories", "CASCADE"),
            _reference("instances", "observation_id", "observations", "SET NULL"),
        ],
    )
    for table, column in (("instances", "category_id"), ("scan_bursts", "scan_id"), ("scans", "observation_id")):
        db.table(table).create_index([column])


def _reference(table: str, column: str, other_table: str, on_delete: str) -> ForeignKey:
    return ForeignKey(table, column, other_table, "id", on_delete=on_delete)
