"""Computing a memory anew with another backbone, from the views it kept.

The new arrays are written beside the old ones, under other names; one transaction makes the rows name them. Stopped before that, the
memory is what it was; stopped after it, the old files are what no row names. Both are swept when it opens again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from sqlite_utils import Database

from core.backbones.base import Backbone
from core.encode import EncodedBurst, Encoder
from core.errors import InvalidInput, OneLookError, Unavailable
from core.packing import burst_as_arrays
from core.reference import build_reference
from core.scores import BEST
from core.view_consistency import consistent_only
from store.arrays import Array, arrays_file, write_arrays
from store.audit import record
from store.bursts import read_burst
from store.categories import reference_columns
from store.columns import decision_from_json, decision_to_json, files_from_json, files_to_json
from store.connection import Connection, Row
from store.contents import FOLDERS
from store.folders import Files, FileSum, sync
from store.instances import insert_instance, token_columns
from store.progress import Progress, untold
from store.sweep import sweep


@dataclass(frozen=True)
class Reembedded:
    """What could be computed anew, and what could not."""

    categories: int
    instances: int
    observations: int
    dropped_instances: int
    """Their views were no longer kept."""
    dropped_observations: int
    """The backbone found no object in them, or their views are damaged."""


@dataclass(frozen=True)
class _Anew:
    """New columns by id."""

    categories: dict[str, Row]
    observations: dict[str, Row]
    tokens: dict[str, Row]
    """By folder of the views, below the memory's."""
    references: dict[str, EncodedBurst]
    lost: list[tuple[str, str]]
    """Tables and ids of observations, and of categories in the bin, that could not be computed."""


def reembed(connection: Connection, backbone: Backbone, *, actor: str | None = None, progress: Progress = untold) -> Reembedded:
    """See `Memory.reembed`."""
    kept = connection.meta()
    try:
        anew = _compute(connection, Encoder(backbone), kept["memory_version"], progress)
        other = kept.get("fingerprint") != backbone.fingerprint
        with connection.change() as db:
            result = _switch(db, anew, other)
            for key, value in (("backbone", backbone.name), ("fingerprint", backbone.fingerprint)):
                db.table("meta").insert({"key": key, "value": value}, replace=True)
            if other:
                db.execute("DELETE FROM meta WHERE key LIKE 'setting:%'")
                _retire_decisions(db, kept.get("backbone", "another"))
            before = {key: kept.get(key) for key in ("backbone", "fingerprint")}
            after = {"backbone": backbone.name, "fingerprint": backbone.fingerprint, "dropped_instances": result.dropped_instances}
            record(db, "reembed", None, before, after, actor)
    except OSError as error:
        raise Unavailable(f"cannot write to the memory in {connection.root}: {error}; free space") from error
    finally:
        sweep(connection)
    return result


def _compute(connection: Connection, encoder: Encoder, generation: str, progress: Progress) -> _Anew:
    anew = _Anew({}, {}, {}, {}, [])
    folders = [(table, row) for table in ("categories", "observations") for row in connection.rows(FOLDERS[table])]
    for done, (table, row) in enumerate(folders):
        folder = connection.root / row["folder"]
        files = files_from_json(row["files"])
        try:
            encoded = consistent_only(encoder.encode(read_burst(folder, files)))
            if table == "categories":
                reference = build_reference(encoded)
                written = _beside(folder, files, f"reference-{generation}.npz", reference.as_arrays())
                anew.categories[row["id"]] = reference_columns(reference, written)
                anew.references[row["id"]] = encoded
            else:
                written = _beside(folder, files, f"features-{generation}.npz", burst_as_arrays(encoded))
                checksum = arrays_file(written)[1].sha256
                anew.observations[row["id"]] = {"files": files_to_json(written), "features_sha256": checksum}
            anew.tokens[row["folder"]] = token_columns(encoded)
        except (InvalidInput, Unavailable) as error:
            if table == "categories":
                _require_in_bin(connection, row["id"], error)
            anew.lost.append((table, row["id"]))
        progress(done + 1, len(folders))
    return anew


def _require_in_bin(connection: Connection, category_id: str, error: OneLookError) -> None:
    (category,) = connection.rows("SELECT name, removed_by FROM categories WHERE id = ?", category_id)
    if category["removed_by"] is None:
        called = category["name"] or category_id
        remedy = "restore it from a backup, or delete it; nothing was changed"
        raise Unavailable(f"category {called} cannot be computed anew: {error}; {remedy}") from error


def _beside(folder: Path, files: Files, name: str, arrays: Mapping[str, Array]) -> dict[str, FileSum]:
    """Writes new arrays beside the old; returns the files that the folder has with them in place of these."""
    write_arrays(folder / name, arrays)
    sync(folder / name)
    sync(folder)
    old, _ = arrays_file(files)
    return {each: file for each, file in files.items() if each != old} | {name: FileSum.of((folder / name).read_bytes())}


def _retire_decisions(db: Database, backbone: str) -> None:
    """Within a transaction: what was found with another backbone is no sample of what objects of no known category find now."""
    for row in list(db.query("SELECT id, decision FROM observations WHERE decision IS NOT NULL")):
        decision = decision_from_json(row["decision"])
        if decision.score == BEST:
            db.table("observations").update(row["id"], {"decision": decision_to_json(replace(decision, score=f"{BEST} by {backbone}"))})


def _switch(db: Database, anew: _Anew, other_backbone: bool) -> Reembedded:
    """Within a transaction."""
    for table, rows in (("categories", anew.categories), ("observations", anew.observations)):
        for row_id, columns in rows.items():
            db.table(table).update(row_id, columns)
    for table, row_id in anew.lost:
        db.execute(f"DELETE FROM {table} WHERE id = ?", [row_id])
        db.execute("UPDATE instances SET pictures = NULL WHERE pictures = ?", [f"{table}/{row_id}"])
    instances, dropped = 0, 0
    for instance in list(db.query("SELECT id, pictures FROM instances")):
        if instance["pictures"] in anew.tokens:
            db.table("instances").update(instance["id"], anew.tokens[instance["pictures"]])
            instances += 1
        elif other_backbone:
            db.execute("DELETE FROM instances WHERE id = ?", [instance["id"]])
            dropped += 1
    empty = "SELECT id FROM categories WHERE id NOT IN (SELECT category_id FROM instances WHERE removed_by IS NULL)"
    # The object that a category was learnt from is one of its kind; what was merged has its bursts elsewhere.
    may_return = "(removed_by IS NULL OR removed_by IN (SELECT id FROM audit WHERE action = 'delete'))"
    for category in list(db.query(f"{empty} AND {may_return}")):
        insert_instance(db, category["id"], anew.references[category["id"]], source="scan", source_id=None, how="scan")
    lost = sum(table == "observations" for table, _ in anew.lost)
    return Reembedded(len(anew.categories), instances, len(anew.observations), dropped, lost)
