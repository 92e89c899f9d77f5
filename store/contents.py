"""Which rows have a folder, where it is, and what its files were when they were written."""

from __future__ import annotations

from core.errors import NotFound
from store.columns import files_from_json
from store.connection import Connection
from store.folders import Files

FOLDERS = {
    "categories": "SELECT id, 'categories/' || id AS folder, files FROM categories",
    "observations": "SELECT id, 'observations/' || id AS folder, files FROM observations",
    "scan_bursts": "SELECT id, 'scans/' || scan_id || '/' || id AS folder, files FROM scan_bursts",
}
"""Each table whose rows have a folder, and where it is below the memory's."""


def files_of(connection: Connection, folder: str) -> Files:
    """Of `categories/ID` or `observations/ID`. Raises NotFound where its row is gone."""
    table, _, row_id = folder.partition("/")
    row = connection.row(f"SELECT files FROM {table} WHERE id = ?", row_id)
    if row is None:
        raise NotFound(f"{folder} was removed from the memory meanwhile")
    return files_from_json(row["files"])
