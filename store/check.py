"""Finding what is damaged: every file against its checksum, every token, and the database's own consistency."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from store.columns import files_from_json
from store.connection import DATABASE, Connection, Row
from store.contents import FOLDERS
from store.folders import Files, problem
from store.instances import TOKENS, damaged
from store.progress import Progress, untold

Kind = Literal["database", "category", "instance", "observation", "scan"]
KINDS: dict[str, Kind] = {"categories": "category", "observations": "observation", "scan_bursts": "scan"}


@dataclass(frozen=True)
class Damage:
    """One thing that is not what was written."""

    kind: Kind
    id: str | None
    """Of the category, instance, observation or scan."""
    name: str | None
    """What people call the category."""
    file: str
    """Below the memory's folder."""
    problem: str
    consequence: str
    """What no longer works, and what still does."""


@dataclass(frozen=True)
class CheckReport:
    """What was looked at, and what was found."""

    categories: int
    files: int
    size: int
    """Bytes of these files."""
    damages: tuple[Damage, ...]

    @property
    def ok(self) -> bool:
        """Whether everything is what was written."""
        return not self.damages


def check(connection: Connection, progress: Progress = untold) -> CheckReport:
    """Reads everything once; others may go on changing the memory meanwhile."""
    damages = _database(connection) + _instances(connection)
    folders = [(table, row, files_from_json(row["files"])) for table, query in FOLDERS.items() for row in connection.rows(query)]
    total = sum(_size(files) for _, _, files in folders)
    done = 0
    for table, row, files in folders:
        found = {name: wrong for name, file in files.items() if (wrong := problem(connection.root / row["folder"] / name, file))}
        as_read = f"SELECT 1 FROM {table} WHERE id = ? AND files = ?"  # else it was removed, or computed anew, meanwhile
        if found and connection.rows(as_read, row["id"], row["files"]):
            damages += [_of_file(connection, table, row, name, wrong) for name, wrong in found.items()]
        done += _size(files)
        progress(done, total)
    living = connection.rows("SELECT count(*) AS count FROM categories WHERE removed_by IS NULL")[0]["count"]
    return CheckReport(living, sum(len(files) for _, _, files in folders), total, tuple(damages))


def _size(files: Files) -> int:
    return sum(file.size for file in files.values())


def _database(connection: Connection) -> list[Damage]:
    consequence = "what its rows say may be wrong or missing; restore the memory from a backup"
    found = [str(row["integrity_check"]) for row in connection.rows("PRAGMA integrity_check(10)")]
    found = [] if found == ["ok"] else found
    found += [f"a row of {row['table']} names one of {row['parent']} that is gone" for row in connection.rows("PRAGMA foreign_key_check")]
    return [Damage("database", None, None, DATABASE, each, consequence) for each in found]


def _instances(connection: Connection) -> list[Damage]:
    columns = ", ".join(("id", *TOKENS, "tokens_sha256"))
    found = []
    for category in connection.rows("SELECT id, name FROM categories"):  # one at a time: tokens of all are much
        rows = connection.rows(f"SELECT {columns} FROM instances WHERE category_id = ? AND removed_by IS NULL", category["id"])
        found += [(row["id"], category["name"]) for row in rows if damaged(row)]
    consequence = "it is left out of the decision; its category is recognised by its other instances, if it has any"
    return [Damage("instance", each, name, DATABASE, "its tokens are not what was written", consequence) for each, name in found]


def _of_file(connection: Connection, table: str, row: Row, name: str, wrong: str) -> Damage:
    kind = KINDS[table]
    called = None
    if kind == "category":
        (category,) = connection.rows("SELECT name, removed_by FROM categories WHERE id = ?", row["id"])
        called = category["name"]
        if category["removed_by"] is not None:
            consequence = "it is deleted or merged; undoing that brings it back damaged"
        elif name.endswith(".npz"):
            consequence = "it gets no poses, but is recognised, and every other category works; restore, reembed or delete it"
        else:
            consequence = "this picture, and computing the category anew with another backbone; it is still recognised and has poses"
    elif kind == "observation":
        consequence = "its pictures; nothing that was learnt, unless another backbone should compute it anew"
    else:
        consequence = "this scan cannot become a category; delete it and begin another"
    whose = row["folder"].split("/")[1]  # of views in a scan the scan's, which their own rows are below
    return Damage(kind, whose, called, f"{row['folder']}/{name}", wrong, consequence)
