"""The database's tables, as a growing list of migrations: a released one is never edited, a change is a new one."""

from __future__ import annotations

import hashlib
import sqlite3
from contextlib import closing
from pathlib import Path

from sqlite_utils import Database, Migrations
from sqlite_utils.db import ForeignKey

from core.errors import Conflict, Unavailable
from store.arrays import BLOB_TYPE
from store.folders import partial_of, sync
from store.parts import parts_from_patches

migrations = Migrations("onelook")


def upgrade(db: Database, database: Path | None = None) -> None:
    """Brings `db` to this version's tables; where it is an earlier version's file `database`, that is copied first.

    Raises Conflict for a database that a later version made, Unavailable where the copy cannot be written.
    """
    with Database(memory=True) as empty:
        known = {migration.name for migration in migrations.pending(empty)}
    later = sorted({migration.name for migration in migrations.applied(db)} - known)
    if later:
        raise Conflict(
            f"the memory was made by a later version of OneLook (steps unknown here: {', '.join(later)}); upgrade onelook to open it"
        )
    pending = migrations.pending(db)
    if database is not None and pending and migrations.applied(db):
        _keep(db, database.with_name(f"{database.name}.before-{pending[0].name}"))
    migrations.apply(db)


def _keep(db: Database, copy: Path) -> None:
    """Writes what `db` holds to the file `copy`, whole or not at all; one of an earlier attempt at the same step is replaced."""
    partial = partial_of(copy)
    try:
        partial.unlink(missing_ok=True)
        with closing(sqlite3.connect(partial)) as target:
            db.conn.backup(target)
        sync(partial)
        partial.rename(copy)
        sync(copy.parent)
    except (OSError, sqlite3.Error) as error:
        partial.unlink(missing_ok=True)
        raise Unavailable(
            f"cannot copy the memory's rows to {copy} before they are upgraded: {error}; free space and start again"
        ) from error


def outdated(database: Path) -> bool:
    """Whether opening this file would change its tables."""
    try:
        with Database(sqlite3.connect(database)) as db:
            return bool(migrations.pending(db))
    except (sqlite3.Error, UnicodeDecodeError):  # whoever opens it says what is wrong with it
        return False


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


@migrations()
def m002_years(db: Database) -> None:
    """What a memory needs that is kept for years: provenance, checksums, an audit trail, goals, and an end to what is only passing."""
    db.table("audit").create(
        {
            "id": str,
            "created_at": str,
            "actor": str,
            "action": str,
            "category_id": str,
            "before": str,
            "after": str,
            "undone_by": str,
        },
        pk="id",
        not_null={"created_at", "action", "before", "after"},
        foreign_keys=[_reference("audit", "undone_by", "audit", "SET NULL")],
    )
    db.table("goals").create(
        {
            "id": str,
            "category_id": str,
            "created_at": str,
            "name": str,
            "target_from_reference": str,
            "frame": str,
            "anchor": str,
            "observation_id": str,
        },
        pk="id",
        not_null={"category_id", "created_at", "target_from_reference", "anchor"},
        foreign_keys=[
            _reference("goals", "category_id", "categories", "CASCADE"),
            _reference("goals", "observation_id", "observations", "SET NULL"),
        ],
    )
    db.table("goals").create_index(["category_id"])
    db.table("requests").create(
        {
            "key": str,
            "route": str,
            "digest": str,
            "created_at": str,
            "result_id": str,
            "status": int,
            "media_type": str,
            "body": bytes,
        },
        pk=("key", "route"),
        not_null={"digest", "created_at"},
    )
    new_columns: dict[str, dict[str, type]] = {
        "categories": {"origin_id": str, "files": str, "removed_by": str},
        "observations": {"files": str},
        "scans": {"expires_at": str},
        "scan_bursts": {"files": str, "report": str},
        "instances": {"how": str, "source_id": str, "similarity": float, "pictures": str, "tokens_sha256": str, "removed_by": str},
    }
    for table, columns in new_columns.items():
        for column, kind in columns.items():
            db.table(table).add_column(column, kind)
    db.execute("UPDATE categories SET origin_id = id")
    db.execute("UPDATE instances SET how = 'scan', pictures = 'categories/' || category_id WHERE source = 'scan'")
    db.execute(
        "UPDATE instances SET source_id = (SELECT s.id FROM scans s WHERE s.category_id = instances.category_id) WHERE source = 'scan'"
    )
    db.execute("UPDATE instances SET how = 'decision', source_id = observation_id WHERE source = 'observation'")
    db.execute("UPDATE instances SET pictures = 'observations/' || observation_id WHERE observation_id IS NOT NULL")
    for instance in list(db.query("SELECT id, cls, pooled FROM instances")):
        sha256 = hashlib.sha256(instance["cls"] + instance["pooled"]).hexdigest()
        db.execute("UPDATE instances SET tokens_sha256 = ? WHERE id = ?", [sha256, instance["id"]])
    for table, column in (("instances", "pictures"), ("instances", "removed_by"), ("categories", "removed_by")):
        db.table(table).create_index([column])


@migrations()
def m003_grounds(db: Database) -> None:
    """How much each observation's answer rests on."""
    db.table("observations").add_column("grounds", str)


@migrations()
def m004_decisions(db: Database) -> None:
    """Patch tokens of each view, which decisions compare; instances from before have none and take no part. Where to look next."""
    db.table("instances").add_column("patches", bytes)
    db.table("observations").add_column("viewpoints", str)


@migrations()
def m005_keys(db: Database) -> None:
    """Who may ask for what, and who signed in."""
    db.table("keys").create(
        {"id": str, "name": str, "role": str, "sha256": str, "created_at": str, "revoked_at": str},
        pk="id",
        not_null={"name", "role", "sha256", "created_at"},
    )
    db.table("sessions").create(
        {"sha256": str, "key_id": str, "created_at": str, "expires_at": str},
        pk="sha256",
        not_null={"key_id", "created_at", "expires_at"},
        foreign_keys=[_reference("sessions", "key_id", "keys", "CASCADE")],
    )


@migrations()
def m006_corrections(db: Database) -> None:
    """What a person said an observation was of; and observations are found by outcome and category, however many there are."""
    db.table("observations").add_column("corrected_to", str)
    for table, column in (("observations", "outcome"), ("observations", "category_id"), ("instances", "source_id")):
        db.table(table).create_index([column])


@migrations()
def m007_members(db: Database) -> None:
    """Which bursts are members of which category is read from an index alone, and only where it may have changed."""
    db.execute("CREATE INDEX instances_living ON instances (removed_by, category_id, id)")
    db.execute("INSERT INTO meta (key, value) VALUES ('members_version', '0')")
    for table, happens in (
        ("instances", "INSERT"),
        ("instances", "DELETE"),
        ("instances", "UPDATE OF category_id, removed_by, cls, pooled, patches"),
        ("categories", "DELETE"),
        ("categories", "UPDATE OF removed_by"),
    ):
        name = f"{table}_{happens.split()[0].lower()}"
        change = "UPDATE meta SET value = value + 1 WHERE key = 'members_version'"
        db.execute(f"CREATE TRIGGER {name} AFTER {happens} ON {table} BEGIN {change}; END")


@migrations()
def m008_parts(db: Database) -> None:
    """Decisions compare 12 parts of a view, which are patches that look alike, where they compared patches drawn at random.

    Parts are made of the patches that were kept. Where these are not sound they are left to be made anew; of damaged ones nothing is made,
    so that they are told of. What an earlier decision found is no sample of what objects of no known category find now.
    """
    db.execute("ALTER TABLE instances RENAME COLUMN patches TO parts")
    for each in list(db.query("SELECT id FROM instances WHERE parts IS NOT NULL")):
        (row,) = db.query("SELECT cls, pooled, parts, views, tokens_sha256 FROM instances WHERE id = ?", [each["id"]])
        tokens = row["cls"] + row["pooled"]
        if hashlib.sha256(tokens + row["parts"]).hexdigest() != row["tokens_sha256"]:
            continue
        try:
            parts = parts_from_patches(row["parts"], row["views"], len(row["cls"]) // BLOB_TYPE.itemsize // row["views"], 12)
        except (ArithmeticError, ValueError):
            parts = None
        sha256 = hashlib.sha256(tokens + (parts or b"")).hexdigest()
        db.execute("UPDATE instances SET parts = ?, tokens_sha256 = ? WHERE id = ?", [parts, sha256, each["id"]])
    db.execute("""UPDATE observations SET decision = replace(decision, '"score": "best"', '"score": "best of patches"')""")


def _reference(table: str, column: str, other_table: str, on_delete: str) -> ForeignKey:
    return ForeignKey(table, column, other_table, "id", on_delete=on_delete)
