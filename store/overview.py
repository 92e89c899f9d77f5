"""Categories a page at a time, with what the memory has seen of each: one query, whose cost is that of the page."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from store.connection import Connection

Order = Literal["name", "seen", "learnt", "instances"]
ORDERS: dict[Order, str] = {
    "name": "c.name IS NULL, c.name COLLATE NOCASE, c.rowid",
    "seen": "last_seen DESC, c.rowid DESC",
    "learnt": "c.rowid DESC",
    "instances": "instances DESC, c.rowid",
}
QUERY = """
    SELECT c.id, c.name, c.created_at, c.views,
        (SELECT count(*) FROM instances i WHERE i.category_id = c.id AND i.removed_by IS NULL) AS instances,
        coalesce((SELECT max(o.created_at) FROM observations o WHERE o.category_id = c.id), c.created_at) AS last_seen,
        (SELECT count(*) FROM observations o WHERE o.category_id = c.id) AS recognised,
        (SELECT count(*) FROM observations o WHERE o.category_id = c.id AND o.pose_error IS NOT NULL) AS without_pose
    FROM categories c WHERE c.removed_by IS NULL
"""


@dataclass(frozen=True)
class Summary:
    """A category as a list shows it."""

    id: str
    name: str | None
    created_at: str
    views: int
    """Of its reference."""
    instances: int
    last_seen: str
    """When an object of it was recognised last, or else when it was learnt."""
    recognised: int
    """Kept observations that were recognised as it."""
    without_pose: int
    """Of these, how many got no pose."""


@dataclass(frozen=True)
class Listing:
    """A page."""

    categories: tuple[Summary, ...]
    total: int
    """On all pages."""


def listing(connection: Connection, limit: int, offset: int, *, order: Order = "name", called: str | None = None) -> Listing:
    """Those whose name has `called` in it, or whose id begins so, in this order."""
    where, parameters = "", []
    if called:
        where = " AND (instr(lower(coalesce(c.name, '')), lower(?)) OR instr(c.id, ?) = 1)"
        parameters = [called, called]
    rows = connection.rows(f"{QUERY}{where} ORDER BY {ORDERS[order]} LIMIT ? OFFSET ?", *parameters, limit, offset)
    (total,) = connection.rows(f"SELECT count(*) AS n FROM categories c WHERE c.removed_by IS NULL{where}", *parameters)
    return Listing(tuple(Summary(**row) for row in rows), total["n"])


def summary(connection: Connection, category_id: str) -> Summary:
    """Of a category that is there."""
    (row,) = connection.rows(f"{QUERY} AND c.id = ?", category_id)
    return Summary(**row)
