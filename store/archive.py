"""Chosen categories as one file, for another robot's memory.

A zip file whose entries are stored as they are, not compressed, so that none can be larger than it says:

manifest.json                what there is, with the size and SHA-256 of every other entry
categories/ID/               the reference's views and arrays
tokens/ID.npz                the tokens of the category's instances
"""

from __future__ import annotations

import io
import logging
import os
import re
import zipfile
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from core.errors import Conflict, Unavailable
from core.rearrange import Anchor
from store.categories import Categories
from store.connection import Connection, Row
from store.contents import files_of
from store.folders import FileSum, make_parents, partial_of, problem, sync
from store.instances import TOKENS, damaged
from store.progress import Progress, untold
from store.records import LONGEST_NAME, Assignment, Category
from store.times import now

MANIFEST = "manifest.json"
FILE_NAME = re.compile(r"\d{3}_(rgb|depth|mask)\.png|cameras\.json|reference(-\d+)?\.npz")
"""What a category's folder may hold."""
log = logging.getLogger("onelook.store")

Id = Annotated[str, StringConstraints(pattern="^[0-9a-f]{32}$")]
Sha256 = Annotated[str, StringConstraints(pattern="^[0-9a-f]{64}$")]
Time = Annotated[str, StringConstraints(pattern=r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d[.0-9]*\+00:00$")]
Name = Annotated[str, StringConstraints(max_length=LONGEST_NAME)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class FileEntry(_Part):
    """An entry of the archive."""

    size: int = Field(ge=0)
    sha256: Sha256

    @property
    def sum(self) -> FileSum:
        """As the memory keeps it."""
        return FileSum(self.size, self.sha256)


class InstanceEntry(_Part):
    """A burst assigned to a category, but for its tokens; see `records.Instance`."""

    created_at: Time
    source: Literal["scan", "observation"]
    source_id: Name | None
    how: Assignment
    similarity: float | None
    views: int = Field(ge=1, le=10_000)
    tokens_sha256: Sha256
    of_reference: bool
    """Whether its views are the reference's."""


class GoalEntry(_Part):
    """A goal; see `records.Goal`."""

    created_at: Time
    name: Name | None
    target_from_reference: str = Field(max_length=2000)
    frame: Name | None
    anchor: Anchor


class CategoryEntry(_Part):
    """A category; see `records.Category`."""

    id: Id
    origin_id: Id
    name: Name | None
    created_at: Time
    files: dict[str, FileEntry]
    tokens: FileEntry
    instances: list[InstanceEntry] = Field(min_length=1, max_length=100_000)
    goals: list[GoalEntry] = Field(max_length=10_000)

    def entries(self) -> dict[str, FileEntry]:
        """What the archive holds of it, by name."""
        return {f"categories/{self.id}/{name}": file for name, file in self.files.items()} | {f"tokens/{self.id}.npz": self.tokens}


class Manifest(_Part):
    """What an archive says of itself; a later version of the format is refused."""

    format: Literal["onelook-categories"]
    version: Literal[1, 2]
    """1 has tokens of patches drawn at random in the place of parts."""
    created_at: Time
    backbone: Name
    fingerprint: Name
    categories: list[CategoryEntry] = Field(min_length=1, max_length=10_000)


@dataclass(frozen=True)
class Export:
    """A file that another memory can import."""

    path: Path
    categories: int
    size: int
    """Bytes."""
    left_out: int
    """Instances whose tokens are damaged."""


def export(
    connection: Connection, categories: Categories, path: Path, category_ids: Sequence[str] | None, progress: Progress = untold
) -> Export:
    """Writes categories, all of them where none are named, to a file that does not exist yet.

    Raises NotFound, Conflict where the file exists or there is nothing to export, Unavailable where something is damaged or cannot be
    written.
    """
    chosen = categories.all() if category_ids is None else [categories.get(each) for each in dict.fromkeys(category_ids)]
    if path.exists():
        raise Conflict(f"{path} exists; export to a new file")
    if not chosen:
        raise Conflict("the memory has no categories to export")
    partial = partial_of(path)
    try:
        make_parents(partial)
        with zipfile.ZipFile(partial, "w", zipfile.ZIP_STORED) as archive:
            parts, left_out = [], 0
            for category in chosen:
                part, damaged_instances = _category(connection, archive, category)
                parts.append(part)
                left_out += damaged_instances
                progress(len(parts), len(chosen))
            kept = connection.meta()
            made_with = {key: kept[key] for key in ("backbone", "fingerprint") if key in kept}
            manifest = Manifest(format="onelook-categories", version=2, created_at=now(), categories=parts, **made_with)
            archive.writestr(_info(MANIFEST), manifest.model_dump_json(indent=1))
        sync(partial)
        os.link(partial, path)  # unlike a rename, this never replaces what came there meanwhile
        sync(path.parent)
    except OSError as error:
        raise Unavailable(f"cannot export to {path}: {error}; free space, or choose another file") from error
    finally:
        with suppress(OSError):  # there may be none, nor a folder for it
            partial.unlink()
    return Export(path, len(parts), path.stat().st_size, left_out)


def _category(connection: Connection, archive: zipfile.ZipFile, category: Category) -> tuple[CategoryEntry, int]:
    """Writes one; returns what the manifest says of it, and how many of its instances are damaged and left out."""
    files = files_of(connection, f"categories/{category.id}")
    for name, file in files.items():
        path = connection.root / "categories" / category.id / name
        if (wrong := problem(path, file)) is not None:
            raise _damaged(category, f"{name} {wrong}")
        archive.writestr(_info(f"categories/{category.id}/{name}"), path.read_bytes())
    found = connection.rows("SELECT * FROM instances WHERE category_id = ? AND removed_by IS NULL ORDER BY rowid", category.id)
    instances = [instance for instance in found if not damaged(instance)]
    if not instances:
        raise _damaged(category, "no burst of it has the tokens that were written")
    if left_out := len(found) - len(instances):
        log.warning("export leaves out %d damaged instances of category %s; `onelook memory check` says more", left_out, category.id)
    tokens = _tokens(instances)
    archive.writestr(_info(f"tokens/{category.id}.npz"), tokens)
    entry = CategoryEntry(
        id=category.id,
        origin_id=category.origin_id,
        name=category.name,
        created_at=category.created_at,
        files={name: FileEntry(size=file.size, sha256=file.sha256) for name, file in files.items()},
        tokens=FileEntry(size=len(tokens), sha256=FileSum.of(tokens).sha256),
        instances=[_instance(instance, category.id) for instance in instances],
        goals=[_goal(goal) for goal in connection.rows("SELECT * FROM goals WHERE category_id = ? ORDER BY rowid", category.id)],
    )
    return entry, left_out


def _damaged(category: Category, how: str) -> Unavailable:
    called = f"category {category.id} ({category.name})" if category.name else f"category {category.id}"
    return Unavailable(f"{called} is damaged: {how}; restore it from a backup, or export the others by naming them")


def _tokens(instances: Sequence[Row]) -> bytes:
    buffer = io.BytesIO()
    blobs = {token_name(index, name): row[name] for index, row in enumerate(instances) for name in TOKENS}
    np.savez(buffer, allow_pickle=False, **{name: np.frombuffer(blob, np.uint8) for name, blob in blobs.items() if blob is not None})
    return buffer.getvalue()


def token_name(index: int, column: str) -> str:
    """The array that holds one BLOB of an instance, byte by byte."""
    return f"{index:06d}_{column}"


def _instance(row: Row, category_id: str) -> InstanceEntry:
    kept = {name: row[name] for name in ("created_at", "source", "source_id", "how", "similarity", "views", "tokens_sha256")}
    return InstanceEntry(**kept, of_reference=row["pictures"] == f"categories/{category_id}")


def _goal(row: Row) -> GoalEntry:
    return GoalEntry(**{name: row[name] for name in ("created_at", "name", "target_from_reference", "frame", "anchor")})


def _info(name: str) -> zipfile.ZipInfo:
    """An entry without a time of its own: the same categories make the same entries."""
    info = zipfile.ZipInfo(name)
    info.external_attr = 0o644 << 16
    return info
