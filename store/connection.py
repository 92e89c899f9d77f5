"""The one SQLite connection of a memory, shared by threads behind a lock."""

from __future__ import annotations

import shutil
import sqlite3
import threading
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from sqlite_utils import Database

from core.errors import Conflict, Unavailable
from store.folders import new_folder
from store.schema import upgrade

Row = dict[str, Any]


class Connection:
    """Rows and folders below `root`, changed together."""

    def __init__(self, root: Path) -> None:
        """Opens or makes the database in `root`, a folder that exists. Raises Unavailable, and Conflict for one of a later version."""
        self.root = root
        self._lock = threading.RLock()
        try:
            self._db = Database(sqlite3.connect(root / "memory.sqlite3", check_same_thread=False))
        except sqlite3.Error as error:
            raise Unavailable(f"cannot open the memory in {root}: {error}; set ONELOOK_DATA_DIR to a folder that can be written") from error
        try:
            self._db.enable_wal()
            self._db.execute("PRAGMA foreign_keys = ON")
            upgrade(self._db)
        except sqlite3.Error as error:
            self._db.close()
            raise Unavailable(f"{root / 'memory.sqlite3'} is no usable database: {error}; restore it from a backup") from error
        except BaseException:
            self._db.close()
            raise

    def close(self) -> None:
        """Closes the file; nothing may be asked afterwards."""
        with self._lock:
            self._db.close()

    def rows(self, sql: str, *parameters: object) -> list[Row]:
        """Every row of a SELECT. Raises Unavailable where the file does not answer."""
        try:
            with self._lock:
                return list(self._db.query(sql, parameters))
        except sqlite3.Error as error:
            raise Unavailable(
                f"the memory in {self.root} does not answer: {error}; check its disk, then start the service again"
            ) from error

    @contextmanager
    def change(self) -> Iterator[Database]:
        """One transaction, which also makes memory_version grow.

        Raises Conflict where it refers to rows that are gone, Unavailable where it cannot be written.
        """
        try:
            with self._lock, self._db.atomic():
                yield self._db
                self._db.execute("UPDATE meta SET value = value + 1 WHERE key = 'memory_version'")
        except sqlite3.IntegrityError as error:
            raise Conflict("a category, scan or observation that this needs was deleted meanwhile; send the request again") from error
        except sqlite3.OperationalError as error:
            raise self._unwritable(error) from error

    def create(self, folder: Path, write: Callable[[Path], None], insert: Callable[[Database], None]) -> None:
        """A folder and its rows, in one step: `write` fills the folder, `insert` commits the rows that make it exist.

        Stopped between the two, a process leaves a folder without a row, which the next start removes.
        """
        try:
            with new_folder(folder) as partial:
                write(partial)
        except OSError as error:
            raise self._unwritable(error) from error
        try:
            with self.change() as db:
                insert(db)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise

    def remove(self, folder: Path, delete: Callable[[Database], object]) -> None:
        """Rows and their folder: the rows go first, so that nothing ever names a folder that is gone."""
        with self.change() as db:
            delete(db)
        shutil.rmtree(folder, ignore_errors=True)

    def _unwritable(self, error: Exception) -> Unavailable:
        return Unavailable(f"cannot write to the memory in {self.root}: {error}; free space or set another ONELOOK_DATA_DIR")


def new_id() -> str:
    """An id no other memory has."""
    return uuid.uuid4().hex


def now() -> str:
    """The time in UTC, ISO 8601."""
    return datetime.now(timezone.utc).isoformat(timespec="milliseconds")


def only(rows: Sequence[Row]) -> Row | None:
    """The row of a query by id, or None."""
    return rows[0] if rows else None
