"""Instances: the bursts assigned to categories, each with where it came from.

Letters: V views, D token size.
"""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np
from sqlite_utils import Database

from core.backbones.whitening import Whitening
from core.encode import EncodedBurst
from core.enrolled import Enrolled
from core.errors import Conflict, NotFound, Unavailable
from core.evidence import part_tokens
from core.nearness import Listed
from core.novelty import Member
from core.views import Burst
from store.arrays import BLOB_TYPE, Array, parts_from_blob, parts_to_blob, tokens_from_blob, tokens_to_blob
from store.audit import record
from store.bursts import read_burst
from store.connection import Connection, Row, new_id
from store.contents import files_of
from store.records import Assignment, Instance
from store.times import now

COLUMNS = "i.id, i.category_id, i.created_at, i.source, i.source_id, i.how, i.similarity, i.views, i.pictures"
LIVING = "FROM instances i JOIN categories c ON c.id = i.category_id WHERE i.removed_by IS NULL AND c.removed_by IS NULL"
TOKENS = ("cls", "pooled", "parts")
"""The columns that hold them."""
Tokens = tuple[Array, Array]
"""[CLS] and pooled, shapes (V, D)."""
MEMBERS = """
    SELECT i.rowid AS place, i.id, i.category_id FROM instances i INDEXED BY instances_living
    WHERE i.removed_by IS NULL AND i.category_id NOT IN (SELECT id FROM categories WHERE removed_by IS NOT NULL)
"""
"""From an index alone: a row is long, and what is asked for lies behind its tokens."""
AT_ONCE = 500
"""Rows read in one go; bounds memory at about 60 MB."""
log = logging.getLogger("onelook.store")


class Instances:
    """The instances of one memory."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._tokens: dict[str, Tokens | None] = {}
        """By instance; None for damaged ones, which are told of once."""
        self._listed: tuple[str, list[Listed]] = ("", [])
        """As of a version of the members."""
        self._told: set[str] = set()
        """Damaged ones that were told of."""
        self._enrolled: Enrolled | None = None

    def of(self, category_id: str) -> list[Instance]:
        """Those of a category, oldest first."""
        rows = self._connection.rows(f"SELECT {COLUMNS} {LIVING} AND i.category_id = ? ORDER BY i.rowid", category_id)
        return [Instance(**row) for row in rows]

    def get(self, instance_id: str) -> Instance:
        """Raises NotFound."""
        row = self._connection.row(f"SELECT {COLUMNS} {LIVING} AND i.id = ?", instance_id)
        if row is None:
            raise NotFound(f"no instance has the id {instance_id!r}; GET /v1/categories/{{id}}/instances lists those of a category")
        return Instance(**row)

    def burst(self, instance_id: str) -> Burst:
        """Its views. Raises NotFound, and Unavailable where they are no longer kept or are damaged."""
        instance = self.get(instance_id)
        if instance.pictures is None:
            raise Unavailable(
                f"the views of instance {instance_id!r} are no longer kept: its observation was dropped as one of the oldest, "
                "`onelook memory reembed` could not use them, or they were not in the archive that it came with"
            )
        return read_burst(self._connection.root / instance.pictures, files_of(self._connection, instance.pictures))

    def forget(self, category_id: str, instance_id: str, *, actor: str | None = None) -> None:
        """Takes one out of a category. Raises NotFound, and Conflict for a category's last."""
        with self._connection.change() as db:
            if self.get(instance_id).category_id != category_id:
                raise NotFound(f"category {category_id!r} has no instance {instance_id!r}")
            entry_id = record(db, "forget", category_id, {"instance": instance_id}, {}, actor)
            db.execute("UPDATE instances SET removed_by = ? WHERE id = ?", [entry_id, instance_id])
            if is_empty(db, category_id):
                raise Conflict(f"instance {instance_id!r} is the last of category {category_id!r}; delete the category instead")

    def enrolled(self, whitening: Whitening | None) -> Enrolled:
        """The same from one call to the next, which the decisions of the score `best` are made by; reads what they need, as they need it.

        `whitening` is that of the memory's one backbone.
        """
        if self._enrolled is None:
            self._enrolled = Enrolled(self, whitening)
        return self._enrolled

    def members(self) -> list[Member]:
        """[CLS] and pooled tokens of every instance, oldest first. A damaged one is left out, so that the others go on being recognised."""
        listed = self.listed()
        tokens = self._load({member.id for member in listed})
        return [Member(member.category_id, *found) for member in listed if (found := tokens.get(member.id)) is not None]

    def listed(self) -> list[Listed]:
        """Every instance and its category, oldest first; the same object while nothing has changed."""
        (version,) = self._connection.rows("SELECT value FROM meta WHERE key = 'members_version'")
        if self._listed[0] != version["value"]:
            rows = sorted(self._connection.rows(MEMBERS), key=lambda row: int(row["place"]))
            self._listed = version["value"], [Listed(row["id"], row["category_id"]) for row in rows]
        return self._listed[1]

    def pooled_means(self, ids: Sequence[str]) -> dict[str, Array]:
        """Means over views of pooled tokens, shape (D,), without instances that have no parts; nothing behind these tokens is read."""
        found = {}
        for row in self._rows(ids, "id, views, pooled, length(pooled) = length(cls) AS whole, typeof(parts) AS parts"):
            if row["parts"] != "null":
                mean = tokens_from_blob(row["pooled"], row["views"]).mean(axis=0) if row["whole"] else np.array(np.nan)
                if np.isfinite(mean).all():
                    found[row["id"]] = mean
                else:
                    self._tell(row["id"])
        return found

    def parts(self, ids: Sequence[str]) -> dict[str, Array]:
        """Tokens of parts, shape (V, K, D), of those that have any and are not damaged."""
        found = {}
        for row in self._rows(ids, f"id, views, {', '.join(TOKENS)}, tokens_sha256"):
            if damaged(row):
                self._tell(row["id"])
            elif row["parts"] is not None:
                found[row["id"]] = parts_from_blob(row["parts"], row["views"], len(row["cls"]) // BLOB_TYPE.itemsize // row["views"])
        return found

    def reload(self) -> None:
        """Reads all tokens anew: they were computed again."""
        self._tokens, self._enrolled = {}, None

    def _load(self, wanted: set[str]) -> dict[str, Tokens | None]:
        """Tokens by instance; what was read once stays in memory."""
        kept = {each: tokens for each, tokens in self._tokens.items() if each in wanted}
        for row in self._rows(sorted(wanted - kept.keys()), f"id, views, {', '.join(TOKENS)}, tokens_sha256"):
            if damaged(row):
                kept[row["id"]] = None
                self._tell(row["id"])
            else:
                kept[row["id"]] = tokens_from_blob(row["cls"], row["views"]), tokens_from_blob(row["pooled"], row["views"])
        self._tokens = kept
        return kept

    def _rows(self, ids: Sequence[str], columns: str) -> Iterator[Row]:
        for start in range(0, len(ids), AT_ONCE):
            named = json.dumps(list(ids[start : start + AT_ONCE]))
            yield from self._connection.rows(f"SELECT {columns} FROM instances WHERE id IN (SELECT value FROM json_each(?))", named)

    def _tell(self, instance_id: str) -> None:
        if instance_id not in self._told:
            self._told.add(instance_id)
            log.warning("the tokens of instance %s are damaged and left out; `onelook memory check` says more", instance_id)


def damaged(row: Row) -> bool:
    """Whether the tokens of an instance's row are not what was written."""
    return bool(tokens_sha256(row) != row["tokens_sha256"])


def tokens_sha256(row: Row) -> str:
    """Checksum of an instance's tokens, which are BLOBs."""
    return hashlib.sha256(b"".join(row[name] or b"" for name in TOKENS)).hexdigest()


def token_columns(encoded: EncodedBurst) -> Row:
    """The columns of an instance that a backbone computed."""
    row: Row = {
        "cls": tokens_to_blob(encoded.cls),
        "pooled": tokens_to_blob(encoded.pooled),
        "parts": parts_to_blob(part_tokens(encoded)),
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
