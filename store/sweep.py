"""What is done when a memory opens, and from time to time: rows and folders are brought to agree, and what is over is removed."""

from __future__ import annotations

from core.errors import NotFound, Unavailable
from core.packing import burst_from_arrays
from store.arrays import arrays_file, read_arrays
from store.columns import files_from_json, files_to_json
from store.connection import Connection
from store.contents import FOLDERS, files_of
from store.folders import remove_orphans, sums
from store.instances import damaged, token_columns
from store.times import ago, ahead


def seal(connection: Connection) -> None:
    """Completes rows that an earlier version wrote: checksums of their files, tokens of parts, and when a scan ends."""
    for table, query in FOLDERS.items():
        for row in connection.rows(f"{query} WHERE files IS NULL"):
            folder = connection.root / row["folder"]
            files = files_to_json(sums(folder)) if folder.is_dir() else "{}"
            with connection.housekeeping() as db:
                db.execute(f"UPDATE {table} SET files = ? WHERE id = ?", [files, row["id"]])
    with connection.housekeeping() as db:
        db.execute("UPDATE scans SET expires_at = ? WHERE expires_at IS NULL", [ahead(connection.retention.scans)])
    for folder in connection.rows("SELECT DISTINCT pictures FROM instances WHERE parts IS NULL AND pictures IS NOT NULL"):
        _complete_tokens(connection, folder["pictures"])


def _complete_tokens(connection: Connection, pictures: str) -> None:
    """Makes the tokens of parts of the instances that a folder shows from its arrays, where these are those of the instances."""
    try:
        name, file = arrays_file(files_of(connection, pictures))
        columns = token_columns(burst_from_arrays(read_arrays(connection.root / pictures / name, file.sha256)))
    except (NotFound, Unavailable, LookupError, StopIteration, ValueError):  # damaged, or no burst's arrays: it stays as it is
        return
    with connection.housekeeping() as db:
        for instance in list(db.query("SELECT * FROM instances WHERE parts IS NULL AND pictures = ?", [pictures])):
            if not damaged(instance) and instance["cls"] == columns["cls"]:
                db.table("instances").update(instance["id"], columns)


def purge(connection: Connection) -> None:
    """Removes for good what was removed too long ago to be undone.

    A category that was merged stays in the bin while its views are those of a burst that lives on in another.
    """
    over = "SELECT id FROM audit WHERE created_at <= ?"
    limit = ago(connection.retention.undo)
    unused = "NOT EXISTS (SELECT 1 FROM instances i WHERE i.pictures = 'categories/' || categories.id AND i.category_id != categories.id)"
    with connection.housekeeping() as db:
        db.execute(f"DELETE FROM instances WHERE removed_by IN ({over})", [limit])
        gone = [row["id"] for row in db.query(f"SELECT id FROM categories WHERE removed_by IN ({over}) AND {unused}", [limit])]
        for category_id in gone:
            db.execute("DELETE FROM categories WHERE id = ?", [category_id])
    connection.remove([connection.root / "categories" / category_id for category_id in gone])


def sweep(connection: Connection) -> None:
    """Removes folders and files that no row names: a stopped process left them."""
    root = connection.root
    for table in ("categories", "observations", "scans"):
        remove_orphans(root / table, {row["id"] for row in connection.rows(f"SELECT id FROM {table}")})
    for scan in connection.rows("SELECT id FROM scans"):
        bursts = connection.rows("SELECT id FROM scan_bursts WHERE scan_id = ?", scan["id"])
        remove_orphans(root / "scans" / scan["id"], {row["id"] for row in bursts})
    for query in FOLDERS.values():
        for row in connection.rows(query):
            remove_orphans(root / row["folder"], set(files_from_json(row["files"])))
