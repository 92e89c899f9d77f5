"""Instances: the bursts assigned to categories, each with where it came from.

Letters: V views, D token size.
"""

from __future__ import annotations

import hashlib
import json
import logging
from typing import Literal

from sqlite_utils import Database

from core.encode import EncodedBurst
from core.errors import Conflict, NotFound, Unavailable
from core.evidence import sample_patches
from core.novelty import Member
from core.views import Burst
from store.arrays import Array, from_blob, patches_from_blob, patches_to_blob, to_blob
from store.audit import record
from store.bursts import read_burst
from store.columns import files_from_json
from store.connection import Connection, Row, new_id, only
from store.records import Assignment, Instance
from store.retention import now

COLUMNS = "i.id, i.category_id, i.created_at, i.source, i.source_id, i.how, i.similarity, i.views, i.pictures"
LIVING = "FROM instances i JOIN categories c ON c.id = i.category_id WHERE i.removed_by IS NULL AND c.removed_by IS NULL"
TOKENS = ("cls", "pooled", "patches")
"""The columns that hold them."""
Tokens = tuple[Array, Array, Array | None]
"""[CLS] and pooled, shapes (V, D), and patches, shape (V, K, D), where they were kept."""
log = logging.getLogger("onelook.store")


class Instances:
    """The instances of one memory."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._tokens: dict[str, Tokens | None] = {}
        """By instance; None for damaged ones, which are told of once."""

    def of(self, category_id: str) -> list[Instance]:
        """Those of a category, oldest first."""
        rows = self._connection.rows(f"SELECT {COLUMNS} {LIVING} AND i.category_id = ? ORDER BY i.rowid", category_id)
        return [Instance(**row) for row in rows]

    def get(self, instance_id: str) -> Instance:
        """Raises NotFound."""
        row = only(self._connection.rows(f"SELECT {COLUMNS} {LIVING} AND i.id = ?", instance_id))
        if row is None:
            raise NotFound(f"no instance has the id {instance_id!r}; GET /v1/categories/{{id}}/instances lists those of a category")
        return Instance(**row)

    def burst(self, instance_id: str) -> Burst:
        """Its views. Raises NotFound, and Unavailable where they were dropped with their observation or are damaged."""
        instance = self.get(instance_id)
        if instance.pictures is None:
            raise Unavailable(f"the views of instance {instance_id!r} are no longer kept: its observation was dropped as one of the oldest")
        table, _, row_id = instance.pictures.partition("/")
        (row,) = self._connection.rows(f"SELECT files FROM {table} WHERE id = ?", row_id)
        return read_burst(self._connection.root / instance.pictures, files_from_json(row["files"]))

    def forget(self, category_id: str, instance_id: str, *, actor: str | None = None) -> None:
        """Takes one out of a category. Raises NotFound, and Conflict for a category's last."""
        if self.get(instance_id).category_id != category_id:
            raise NotFound(f"category {category_id!r} has no instance {instance_id!r}")
        with self._connection.change() as db:
            entry_id = record(db, "forget", category_id, {"instance": instance_id}, {}, actor)
            db.execute("UPDATE instances SET removed_by = ? WHERE id = ? AND removed_by IS NULL", [entry_id, instance_id])
            if is_empty(db, category_id):
                raise Conflict(f"instance {instance_id!r} is the last of category {category_id!r}; delete the category instead")

    def members(self) -> list[Member]:
        """Tokens of every instance, oldest first. A damaged one is left out, so that the others go on being recognised."""
        rows = self._connection.rows(f"SELECT i.id, i.category_id {LIVING} ORDER BY i.rowid")
        tokens = self._load({row["id"] for row in rows})
        return [Member(row["category_id"], *found) for row in rows if (found := tokens.get(row["id"])) is not None]

    def reload(self) -> None:
        """Reads all tokens anew: they were computed again."""
        self._tokens = {}

    def _load(self, wanted: set[str]) -> dict[str, Tokens | None]:
        """Tokens by instance; what was read once stays in memory."""
        kept = {each: tokens for each, tokens in self._tokens.items() if each in wanted}
        new = json.dumps(sorted(wanted - kept.keys()))
        query = f"SELECT id, views, {', '.join(TOKENS)}, tokens_sha256 FROM instances WHERE id IN (SELECT value FROM json_each(?))"
        for row in self._connection.rows(query, new):
            kept[row["id"]] = None if damaged(row) else _tokens(row)
            if kept[row["id"]] is None:
                log.warning("the tokens of instance %s are damaged and left out; `onelook memory check` says more", row["id"])
        self._tokens = kept
        return kept


def damaged(row: Row) -> bool:
    """Whether the tokens of an instance's row are not what was written."""
    return bool(tokens_sha256(row) != row["tokens_sha256"])


def tokens_sha256(row: Row) -> str:
    """Checksum of an instance's tokens, which are BLOBs."""
    return hashlib.sha256(b"".join(row[name] or b"" for name in TOKENS)).hexdigest()


def _tokens(row: Row) -> Tokens:
    cls, pooled = (from_blob(row[name], row["views"]) for name in ("cls", "pooled"))
    return cls, pooled, None if row["patches"] is None else patches_from_blob(row["patches"], *cls.shape)


def token_columns(encoded: EncodedBurst) -> Row:
    """The columns of an instance that a backbone computed."""
    row: Row = {
        "cls": to_blob(encoded.cls),
        "pooled": to_blob(encoded.pooled),
        "patches": patches_to_blob(sample_patches(encoded)),
    }
    return row | {"views": len(encoded.cls), "tokens_sha256": tokens_sha256(row)}


def is_empty(db: Database, category_id: str) -> bool:
    """Whether no burst is left in a category."""
    (left,) = db.execute("SELECT count(*) FROM instances WHERE category_id = ? AND removed_by IS NULL", [category_id]).fetchone()
    return not left


def insert_instance(
    db: Database,
    category_id: str,
    encoded: EncodedBurst,
    *,
    source: Literal["scan", "observation"],
    source_id: str | None,
    how: Assignment,
    similarity: float | None = None,
) -> str:
    """Assigns a burst to a category within a transaction; returns the instance's id."""
    instance_id = new_id()
    row = {
        "id": instance_id,
        "category_id": category_id,
        "created_at": now(),
        "source": source,
        "observation_id": source_id if source == "observation" else None,
        "source_id": source_id,
        "how": how,
        "similarity": similarity,
        "pictures": f"observations/{source_id}" if source == "observation" else f"categories/{category_id}",
    }
    db.table("instances").insert(row | token_columns(encoded))
    return instance_id
