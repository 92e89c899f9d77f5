"""A copy of a memory while it is used: the database by SQLite's online backup, then the folders that the copied rows name.

Folders never change once they have their name, but for arrays that were computed anew, under another name. So only what was removed since
the rows were copied can be missing: then the rows are copied again.
"""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from core.errors import Conflict, Unavailable
from store.check import Damage, check
from store.columns import files_from_json
from store.connection import DATABASE, Connection
from store.contents import FOLDERS
from store.folders import Files, make_parents, new_folder, partial_of, sync
from store.progress import Progress, untold
from store.sweep import sweep

ATTEMPTS = 10
"""A memory from which something is removed during each of so many copies of the missing folders is not at rest for a moment."""


@dataclass(frozen=True)
class Backup:
    """A copy that opens as a memory."""

    folder: Path
    files: int
    size: int
    """Bytes of these files."""
    damages: tuple[Damage, ...]
    """What is damaged in the memory, and so in its copy."""


def back_up(connection: Connection, folder: Path, progress: Progress = untold) -> Backup:
    """Copies a memory to a folder that does not exist yet, and reads the copy once to see that it is whole.

    Raises Conflict where the folder exists, Unavailable where it cannot be written.
    """
    if folder.exists():
        raise Conflict(f"{folder} exists; back up to a new folder")
    partial = partial_of(folder)
    try:
        shutil.rmtree(partial, ignore_errors=True)
        make_parents(partial)
        partial.mkdir()
        for _ in range(ATTEMPTS):
            _copy_rows(connection, partial)
            if _copy_folders(connection, partial, progress):
                break
        else:
            raise Unavailable(f"things are removed from the memory in {connection.root} faster than they are copied; back up later")
        with closing(Connection(partial, connection.retention)) as copy:
            sweep(copy)
            report = check(copy)
        sync(partial / DATABASE)
        sync(partial)
        partial.rename(folder)
        sync(folder.parent)
    except (OSError, sqlite3.OperationalError) as error:
        raise Unavailable(f"cannot back up to {folder}: {error}; free space, or choose another folder") from error
    except sqlite3.Error as error:
        raise Unavailable(f"{connection.root / DATABASE} is damaged: {error}; restore it from a backup") from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)  # there is none once it has its name
    return Backup(folder, report.files, report.size, report.damages)


def _copy_rows(connection: Connection, partial: Path) -> None:
    (partial / DATABASE).unlink(missing_ok=True)
    with closing(sqlite3.connect(connection.root / DATABASE)) as source, closing(sqlite3.connect(partial / DATABASE)) as target:
        source.backup(target)


def _copy_folders(connection: Connection, partial: Path, progress: Progress) -> bool:
    """Copies the folders that the copied rows name and that are not there yet; returns False where something was removed meanwhile."""
    with closing(sqlite3.connect(partial / DATABASE)) as copied:
        named = [(table, *row) for table, query in FOLDERS.items() for row in copied.execute(query)]
    total = sum(file.size for *_, files in named for file in files_from_json(files).values())
    done, whole = 0, True
    for table, row_id, folder, text in named:
        files = files_from_json(text)
        if not all((partial / folder / name).exists() for name in files):
            shutil.rmtree(partial / folder, ignore_errors=True)
            copied_all = _copy_folder(connection.root / folder, partial / folder, files)
            whole &= copied_all or bool(connection.rows(f"SELECT 1 FROM {table} WHERE id = ? AND files = ?", row_id, text))
        done += sum(file.size for file in files.values())
        progress(done, total)
    return whole


def _copy_folder(source: Path, target: Path, files: Files) -> bool:
    """Copies what is there; returns whether that was all."""
    whole = True
    with new_folder(target) as partial:
        for name in files:
            try:
                shutil.copyfile(source / name, partial / name)
            except FileNotFoundError:
                whole = False
    return whole
