"""How much a memory holds."""

from __future__ import annotations

from dataclasses import dataclass

from store.connection import DATABASE, Connection
from store.contents import FOLDERS
from store.instances import LIVING
from store.scans import IN_PROGRESS
from store.times import now

BYTES = "SELECT coalesce(sum(json_extract(each.value, '$[0]')), 0) AS n FROM {table} AS kept, json_each(kept.files) AS each"
"""Of the files that a table's rows name; SQLite adds them up ten times as fast as Python reads them."""
COUNTS = {
    "categories": "SELECT count(*) AS n FROM categories WHERE removed_by IS NULL",
    "instances": f"SELECT count(*) AS n {LIVING}",
    "observations": "SELECT count(*) AS n FROM observations",
    "goals": "SELECT count(*) AS n FROM goals g JOIN categories c ON c.id = g.category_id WHERE c.removed_by IS NULL",
}


@dataclass(frozen=True)
class Sizes:
    """What lives, counted, and the bytes of all that is kept."""

    categories: int
    instances: int
    observations: int
    scans: int
    """In progress."""
    goals: int
    size: int
    """Bytes on disk, the bin included."""


def sizes(connection: Connection) -> Sizes:
    """Counts of what lives, and bytes of all that is kept."""
    kept = sum(connection.rows(BYTES.format(table=table))[0]["n"] for table in FOLDERS)
    size = kept + (connection.root / DATABASE).stat().st_size
    scans = connection.rows(f"SELECT count(*) AS n FROM scans WHERE {IN_PROGRESS}", now())[0]["n"]
    return Sizes(**{name: connection.rows(query)[0]["n"] for name, query in COUNTS.items()}, scans=scans, size=size)
