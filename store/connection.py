"""The one SQLite connection of a memory, shared by threads behind a lock."""

from __future__ import annotations

import shutil
import sqlite3
import threading
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from sqlite_utils import Database

from core.errors import Conflict, Unavailable
from store.folders import FileSum, new_folder, partial_of, sums
from store.retention import Retention
from store.schema import upgrade

Row = dict[str, Any]
DATABASE = "memory.sqlite3"

TAKE_TURN = "UPDATE meta SET value = value WHERE key = 'memory_version'"
"""Changes nothing, and comes first: SQLite waits for another process (`onelook keys`) to end its change only before a transaction has
read anything."""

before_change: ContextVar[Callable[[], None] | None] = ContextVar("before_change", default=None)
"""Called before anything of a change is written; raises where whoever asked for the change does not want it any more."""

TRIAL = ".trial"
"""Name of a folder that is made to see whether the disk takes one again."""
TRIAL_BYTES = 1_000_000
"""What is in it: as much as a small burst."""

running_request: ContextVar[tuple[str, str] | None] = ContextVar("running_request", default=None)
"""Key and route of the repeatable request that the present changes are made for; see store/requests.py."""


class Connection:
    """Rows and folders below `root`, changed together."""

    def __init__(self, root: Path, retention: Retention | None = None, *, only_read: bool = False) -> None:
        """Opens or makes the database in `root`, a folder that exists; `only_read` refuses every change.

        Raises Unavailable, and Conflict for one of a later version.
        """
        self.root = root
        self.retention = retention or Retention()
        self._lock = threading.RLock()
        self._trial_lock = threading.Lock()
        self._failed: set[str] = set()
        """What could not be written the last time: `files`, `rows`, or both."""
        try:
            self._db = Database(sqlite3.connect(root / DATABASE, check_same_thread=False))
        except sqlite3.Error as error:
            raise Unavailable(f"cannot open the memory in {root}: {error}; set ONELOOK_DATA_DIR to a folder that can be written") from error
        try:
            self._db.enable_wal()
            self._db.execute("PRAGMA synchronous = FULL")  # a committed row survives a power cut, as its folder does
            self._db.execute("PRAGMA foreign_keys = ON")
            upgrade(self._db, root / DATABASE)
            self._db.execute(f"PRAGMA query_only = {int(only_read)}")
        except (sqlite3.Error, UnicodeDecodeError) as error:  # SQLite quotes the damage, which need not be text
            self._db.close()
            raise Unavailable(f"{root / DATABASE} is no usable database: {error}; restore it from a backup") from error
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

    def row(self, sql: str, *parameters: object) -> Row | None:
        """The first row of a SELECT, None where there is none. Raises as `rows` does."""
        return next(iter(self.rows(sql, *parameters)), None)

    def require_sound(self) -> None:
        """Raises Unavailable where the database cannot be read, or where writing failed the last time and still does."""
        self.rows("SELECT value FROM meta WHERE key = 'memory_version'")
        if not self._failed:
            return
        trial = self.root / TRIAL
        with self._trial_lock:
            self.remove([trial, partial_of(trial)])  # of a process that was stopped here
            try:
                with new_folder(trial) as partial:
                    (partial / "trial").write_bytes(bytes(TRIAL_BYTES))
            except OSError as error:
                raise self._unwritable("files", error) from error
            finally:
                self.remove([trial])
            self._failed.discard("files")
            with self.housekeeping():
                pass

    def meta(self) -> dict[str, str]:
        """What is kept of the memory as a whole, by key."""
        return {row["key"]: row["value"] for row in self.rows("SELECT key, value FROM meta")}

    @contextmanager
    def change(self, made: str | None = None) -> Iterator[Database]:
        """One transaction, which also makes memory_version grow, and notes what a repeatable request `made`.

        Raises Conflict where it refers to rows that are gone, Unavailable where it cannot be written.
        """
        self._require_wanted()
        with self.housekeeping() as db:
            yield db
            db.execute("UPDATE meta SET value = value + 1 WHERE key = 'memory_version'")
            request = running_request.get()
            if made is not None and request is not None:
                db.execute("UPDATE requests SET result_id = ? WHERE key = ? AND route = ?", [made, *request])

    @contextmanager
    def housekeeping(self) -> Iterator[Database]:
        """One transaction that changes nothing a reader could see. Raises as `change` does."""
        try:
            with self._lock, self._db.atomic():
                self._db.execute(TAKE_TURN)
                yield self._db
            self._failed.discard("rows")
        except sqlite3.IntegrityError as error:
            raise Conflict("a category, scan or observation that this needs was deleted meanwhile; send the request again") from error
        except sqlite3.ProgrammingError:
            raise
        except sqlite3.DatabaseError as error:
            raise self._unwritable("rows", error) from error

    def create(
        self,
        folder: Path,
        write: Callable[[Path], None],
        insert: Callable[[Database, dict[str, FileSum]], None],
        *,
        made: str | None = None,
    ) -> None:
        """A folder and its rows, in one step: `write` fills the folder, `insert` gets what is in it and adds the rows that name it."""
        self.create_all({folder: write}, lambda db, files: insert(db, files[folder]), made=made)

    def create_all(
        self,
        folders: Mapping[Path, Callable[[Path], None]],
        insert: Callable[[Database, dict[Path, dict[str, FileSum]]], None],
        *,
        made: str | None = None,
    ) -> None:
        """`create` for several folders, which appear together or not at all.

        Stopped before the rows are committed, a process leaves folders without rows, which the next start removes.
        """
        self._require_wanted()
        files: dict[Path, dict[str, FileSum]] = {}
        with ExitStack() as undo:
            for folder, write in folders.items():
                undo.callback(shutil.rmtree, folder, ignore_errors=True)
                try:
                    with new_folder(folder) as partial:
                        write(partial)
                        files[folder] = sums(partial)
                except OSError as error:
                    raise self._unwritable("files", error) from error
                self._failed.discard("files")
            with self.change(made) as db:
                insert(db, files)
            undo.pop_all()

    def remove(self, folders: Sequence[Path]) -> None:
        """Folders that no row names any more: rows go first, so that nothing ever names a folder that is gone."""
        for folder in folders:
            shutil.rmtree(folder, ignore_errors=True)

    def _require_wanted(self) -> None:
        ask = before_change.get()
        if ask is not None:
            ask()

    def _unwritable(self, what: str, error: Exception) -> Unavailable:
        self._failed.add(what)
        return Unavailable(f"cannot write to the memory in {self.root}: {error}; free space or set another ONELOOK_DATA_DIR")


def new_id() -> str:
    """An id no other memory has."""
    return uuid.uuid4().hex
