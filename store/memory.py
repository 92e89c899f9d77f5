"""The memory: one folder with a SQLite file and, beside it, the arrays and images that its rows name.

FOLDER/
├── memory.sqlite3      rows, [CLS] and pooled tokens
├── lock                held by the process that writes here
├── categories/ID/      reference.npz and the reference views
├── scans/ID/ID/        the views of each burst of a scan in progress
└── observations/ID/    features.npz and the views
"""

from __future__ import annotations

import fcntl
from io import TextIOWrapper
from pathlib import Path
from types import TracebackType

from core.errors import Conflict, Unavailable
from store.categories import Categories
from store.connection import Connection
from store.folders import remove_orphans
from store.observations import Observations
from store.scans import Scans


class Memory:
    """An open memory; safe to use from several threads."""

    def __init__(self, connection: Connection, lock: TextIOWrapper) -> None:
        self._connection = connection
        self._lock = lock
        self.folder = connection.root
        self.categories = Categories(connection)
        self.scans = Scans(connection)
        self.observations = Observations(connection)

    @classmethod
    def open(cls, folder: Path) -> Memory:
        """Opens the memory in `folder`, or makes an empty one; removes what a stopped process left half written.

        Raises Conflict where another process has it open, or a later version made it; Unavailable where it cannot be written.
        """
        lock = _lock(folder)
        try:
            memory = cls(Connection(folder), lock)
        except BaseException:
            lock.close()
            raise
        memory._sweep()
        return memory

    @property
    def version(self) -> int:
        """A number that grows with each change."""
        return int(self._meta("memory_version") or 0)

    @property
    def fingerprint(self) -> str | None:
        """The backbone that this memory's tokens came from; None before the first."""
        return self._meta("fingerprint")

    def require_backbone(self, name: str, fingerprint: str) -> None:
        """Ties an empty memory to a backbone. Raises Conflict where it is tied to another, whose tokens cannot be compared."""
        kept = self.fingerprint
        if kept is None:
            with self._connection.change() as db:
                db.table("meta").insert_all([{"key": "backbone", "value": name}, {"key": "fingerprint", "value": fingerprint}])
        elif kept != fingerprint:
            raise Conflict(
                f"the memory in {self.folder} was made with backbone {self._meta('backbone')} (fingerprint {kept}), "
                f"this service uses {name} (fingerprint {fingerprint}): their tokens cannot be compared; "
                "start with the first backbone (ONELOOK_BACKBONE), or keep another memory for this one (ONELOOK_DATA_DIR)"
            )

    def check(self) -> None:
        """Raises Unavailable where the database does not answer."""
        self._connection.rows("SELECT 1")

    def close(self) -> None:
        """Closes the file and lets other processes in."""
        self._connection.close()
        self._lock.close()

    def __enter__(self) -> Memory:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _meta(self, key: str) -> str | None:
        rows = self._connection.rows("SELECT value FROM meta WHERE key = ?", key)
        return str(rows[0]["value"]) if rows else None

    def _sweep(self) -> None:
        for table, root in (("categories", self.categories.root), ("observations", self.observations.root), ("scans", self.scans.root)):
            remove_orphans(root, {row["id"] for row in self._connection.rows(f"SELECT id FROM {table}")})
        if self.scans.root.is_dir():
            for scan in self.scans.root.iterdir():
                remove_orphans(scan, set(self.scans.burst_ids(scan.name)))


def _lock(folder: Path) -> TextIOWrapper:
    """Keeps other processes out until it is closed, also by the end of this one."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = (folder / "lock").open("w")
    except OSError as error:
        raise Unavailable(f"cannot open the memory in {folder}: {error}; set ONELOOK_DATA_DIR to a folder that can be written") from error
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        lock.close()
        raise Conflict(f"the memory in {folder} is open in another process; stop that one, or set another ONELOOK_DATA_DIR") from None
    return lock
