"""Taking categories from another memory's archive: all that it names is judged before anything is written, then all appear at once."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np
from pydantic import ValidationError
from sqlite_utils import Database

from core.errors import Conflict, InvalidInput, OneLookError, Unavailable
from core.evidence import PARTS
from core.reference import Reference
from core.sim3 import Sim3
from store import untrusted
from store.archive import FILE_NAME, MANIFEST, CategoryEntry, GoalEntry, InstanceEntry, Manifest, token_name
from store.arrays import BLOB_TYPE, arrays_file, parts_from_blob
from store.audit import record
from store.bursts import read_burst
from store.categories import Categories, insert_category
from store.columns import sim3_from_json
from store.connection import Connection, Row, new_id
from store.folders import Files, FileSum
from store.instances import TOKENS, tokens_sha256
from store.parts import parts_from_patches
from store.progress import Progress, untold
from store.records import Category

MAX_MANIFEST_BYTES = 32_000_000
"""A category takes some kilobytes, an instance half of one."""
PLACES = ("cloud_m", "world_from_object", "extent_m", "symmetries")
"""Arrays of a reference; others may say by NaN that something was not measured."""


@dataclass(frozen=True)
class Imported:
    """A category that was not known before."""

    archive_id: str
    id: str
    """In this memory."""
    name: str | None
    instances: int
    goals: int
    same_name: tuple[str, ...]
    """Categories that had this name already; names need not be unique."""


@dataclass(frozen=True)
class Duplicate:
    """A category that the memory has already: it is left as it is."""

    archive_id: str
    id: str
    """In this memory."""
    name: str | None


@dataclass(frozen=True)
class Import:
    """What an archive brought."""

    entry_id: str
    """Of the audit trail."""
    categories: tuple[Imported, ...]
    duplicates: tuple[Duplicate, ...]


@dataclass(frozen=True, eq=False)
class _Archive:
    """An archive that holds what its manifest names, and nothing else."""

    zip: zipfile.ZipFile
    entries: Mapping[str, zipfile.ZipInfo]
    manifest: Manifest

    def content(self, name: str) -> bytes:
        """Of an entry."""
        return untrusted.content(self.zip, self.entries[name])


@dataclass(frozen=True, eq=False)
class _Judged:
    """A category of an archive that is in order."""

    entry: CategoryEntry
    id: str
    reference: Reference
    instances: list[Row]


def import_archive(connection: Connection, categories: Categories, path: Path, *, actor: str | None, progress: Progress = untold) -> Import:
    """See `Memory.import_archive`; `categories` are the memory's."""
    try:
        with untrusted.opened(path, path.name) as opened:
            entries = untrusted.entries(opened, path.stat().st_size)
            manifest = _manifest(opened, entries)
            _require_backbone(connection, manifest)
            archive = _Archive(opened, entries, manifest)
            for index, part in enumerate(manifest.categories):
                _judge_entries(archive, part)
                progress(index + 1, len(manifest.categories))
            return _bring(connection, categories, archive, path.name, actor)
    except OSError as error:
        raise Unavailable(f"cannot read {path}: {error}") from error


def _manifest(archive: zipfile.ZipFile, found: Mapping[str, zipfile.ZipInfo]) -> Manifest:
    """What the archive says of itself, when that is exactly what is in it."""
    if MANIFEST not in found:
        raise InvalidInput(untrusted.FIELD, f"has no {MANIFEST}; `onelook memory export` writes an archive of categories")
    try:
        manifest = Manifest.model_validate_json(untrusted.content(archive, found[MANIFEST], MAX_MANIFEST_BYTES))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(each) for each in first["loc"])
        raise InvalidInput(untrusted.FIELD, f"its {MANIFEST} is not one that this version reads: {where}: {first['msg']}") from None
    named = {MANIFEST, *(name for part in manifest.categories for name in part.entries())}
    if strange := sorted(named ^ found.keys()):
        raise InvalidInput(untrusted.FIELD, f"{strange[0]!r} is in the archive or in its {MANIFEST}, but not in both")
    if len({part.id for part in manifest.categories}) < len(manifest.categories):
        raise InvalidInput(untrusted.FIELD, f"its {MANIFEST} has several categories of the same id")
    for part in manifest.categories:
        if strange := [name for name in part.files if not FILE_NAME.fullmatch(name)]:
            raise InvalidInput(untrusted.FIELD, f"{strange[0]!r} is no file of a category")
    return manifest


def _require_backbone(connection: Connection, manifest: Manifest) -> None:
    kept = connection.meta()
    if kept.get("fingerprint", manifest.fingerprint) != manifest.fingerprint:
        raise Conflict(
            f"the archive was made with backbone {manifest.backbone} (fingerprint {manifest.fingerprint}), this memory with "
            f"{kept['backbone']} (fingerprint {kept['fingerprint']}): their tokens cannot be compared; "
            "`onelook memory reembed` computes the other memory anew with this one's, then export again"
        )


def _duplicates(manifest: Manifest, existing: list[Category]) -> tuple[Duplicate, ...]:
    known = {key: category for category in existing for key in (category.id, category.origin_id)}
    same = [(part.id, known.get(part.origin_id) or known.get(part.id)) for part in manifest.categories]
    return tuple(Duplicate(archive_id, category.id, category.name) for archive_id, category in same if category is not None)


def _judge_entries(archive: _Archive, part: CategoryEntry) -> None:
    """Raises InvalidInput unless every entry is what the manifest says, and of the kind that its name says."""
    for name, file in part.entries().items():
        written = archive.content(name)
        if FileSum.of(written) != file.sum:
            raise InvalidInput(untrusted.FIELD, f"{name!r} is not what {MANIFEST} says (SHA-256 differs); copy the archive again")
        if name.endswith(".png"):
            untrusted.require_picture(written, name)
        elif name.endswith(".npz"):
            untrusted.arrays(written, name)


def _bring(connection: Connection, categories: Categories, archive: _Archive, source: str, actor: str | None) -> Import:
    manifest, existing = archive.manifest, categories.all()
    duplicates = _duplicates(manifest, existing)
    known = {duplicate.archive_id for duplicate in duplicates}
    parts = [part for part in manifest.categories if part.id not in known]
    judged: dict[Path, _Judged] = {}
    ids = {part.id: new_id() for part in parts}
    entry_id = new_id()

    def writer(part: CategoryEntry) -> Callable[[Path], None]:
        def write(folder: Path) -> None:
            for name in part.files:
                (folder / name).write_bytes(archive.content(f"categories/{part.id}/{name}"))
            tokens = archive.content(f"tokens/{part.id}.npz")
            judged[folders[part.id]] = _judge_category(folder, part, ids[part.id], manifest, tokens)

        return write

    def insert(db: Database, files: Mapping[Path, Files]) -> None:
        if _duplicates(manifest, categories.all()) != duplicates:
            raise Conflict("categories that are in the archive came, went or were renamed meanwhile; import it again")
        for key in ("backbone", "fingerprint"):  # an empty memory takes the archive's
            db.table("meta").insert({"key": key, "value": getattr(manifest, key)}, ignore=True)
        for folder, each in judged.items():
            _insert(db, each, files[folder])
        after = {"archive": source, "categories": list(ids.values()), "duplicates": [duplicate.id for duplicate in duplicates]}
        record(db, "import", None, {}, after, actor, entry_id=entry_id)

    folders = {part.id: connection.root / "categories" / ids[part.id] for part in parts}
    connection.create_all({folders[part.id]: writer(part) for part in parts}, insert, made=entry_id)
    return Import(entry_id, tuple(_imported(each, existing) for each in judged.values()), duplicates)


def _imported(judged: _Judged, existing: list[Category]) -> Imported:
    name = judged.entry.name
    same = tuple(category.id for category in existing if name is not None and category.name == name)
    return Imported(judged.entry.id, judged.id, name, len(judged.instances), len(judged.entry.goals), same)


def _judge_category(folder: Path, part: CategoryEntry, category_id: str, manifest: Manifest, tokens: bytes) -> _Judged:
    """Reads a category as the service would. Raises InvalidInput where it cannot."""
    try:
        files = {name: entry.sum for name, entry in part.files.items()}
        name, _ = arrays_file(files)
        arrays = untrusted.arrays((folder / name).read_bytes(), name)
        for field in PLACES:
            _require(bool(np.isfinite(arrays[field]).all()), f"{field} of {name} is finite")
        burst, reference = read_burst(folder, files), Reference.from_arrays(arrays)
        made: tuple[CategoryEntry | InstanceEntry | GoalEntry, ...] = (part, *part.instances, *part.goals)
        for dated in made:
            datetime.fromisoformat(dated.created_at)
        for goal in part.goals:
            _require_pose(sim3_from_json(goal.target_from_reference))
        _require(len(reference.views) == len(burst), "its reference has as many views as pictures")
        _require(reference.fingerprint == manifest.fingerprint, "its reference was made with the archive's backbone")
        _require(reference.box.extent_m.shape == (3,), "its box has three edges")
        for view in reference.views:
            _require(len(view.cells) == len(view.descriptors) == len(view.points_m), "each patch has a descriptor and a point")
        instances = _instances(part, category_id, tokens, len(reference.views[0].cls), manifest.version)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError, RecursionError, OneLookError) as error:
        about = f"category {part.id} cannot be read ({type(error).__name__}: {error})"
        raise InvalidInput(untrusted.FIELD, f"{about}; export it again") from error
    return _Judged(part, category_id, reference, instances)


def _instances(part: CategoryEntry, category_id: str, tokens: bytes, dim: int, version: int) -> list[Row]:
    arrays = untrusted.arrays(tokens, "tokens")
    kept_as = {"parts": "patches"} if version == 1 else {}
    rows = []
    for index, instance in enumerate(part.instances):
        found = {column: arrays.get(token_name(index, kept_as.get(column, column))) for column in TOKENS}
        blobs: Row = {column: None if array is None else array.tobytes() for column, array in found.items()}
        _require_sound(blobs, index, instance, dim, version)
        if version == 1 and blobs["parts"] is not None:
            blobs["parts"] = parts_from_patches(blobs["parts"], instance.views, dim, PARTS)
        pictures = f"categories/{category_id}" if instance.of_reference else None
        own = {"id": new_id(), "category_id": category_id, "pictures": pictures, "tokens_sha256": tokens_sha256(blobs)}
        rows.append(instance.model_dump(exclude={"of_reference"}) | blobs | own)
    return rows


def _require_sound(blobs: Row, index: int, instance: InstanceEntry, dim: int, version: int) -> None:
    _require(tokens_sha256(blobs) == instance.tokens_sha256, f"the tokens of instance {index} are what was written")
    for column in ("cls", "pooled"):
        tokens_of = np.frombuffer(blobs[column], BLOB_TYPE).reshape(instance.views, dim)
        _require(bool(np.isfinite(tokens_of).all()), f"{column} of instance {index} is finite")
    if blobs["parts"] is not None:
        parts = parts_from_blob(blobs["parts"], instance.views, dim)
        _require(version == 1 or parts.shape[1] == PARTS, f"instance {index} has {PARTS} parts a view")
        _require(parts.shape[1] > 0 and bool(np.isfinite(parts).all()), f"the parts of instance {index} are finite")


def _require_pose(pose: Sim3) -> None:
    """By its parts: their product may be the matrix of a similarity though they are none of it."""
    _require(pose.rotation.shape == (3, 3) and pose.translation.shape == (3,), "its goals are transforms of space")
    _require(bool(np.isfinite(pose.translation).all()), "its goals are somewhere")
    _require(bool(np.isclose(Sim3.from_matrix(pose.as_matrix()).scale, pose.scale)), "its goals have a scale and a rotation")


def _require(holds: bool, what: str) -> None:
    if not holds:
        raise ValueError(f"it does not hold that {what}")


def _insert(db: Database, judged: _Judged, files: Files) -> None:
    part = judged.entry
    views = len(judged.reference.views)
    insert_category(db, judged.id, judged.reference, views, files, name=part.name, origin_id=part.origin_id, created_at=part.created_at)
    db.table("instances").insert_all(judged.instances)
    db.table("goals").insert_all(goal.model_dump() | {"id": new_id(), "category_id": judged.id} for goal in part.goals)
