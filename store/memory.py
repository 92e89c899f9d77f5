"""The memory: one folder with a SQLite file and, beside it, the arrays and images that its rows name.

FOLDER/
├── memory.sqlite3      rows, and in them the tokens that decisions compare
├── lock                held by the process that writes here
├── categories/ID/      the reference's arrays and views
├── scans/ID/ID/        the views of each burst of a scan in progress
└── observations/ID/    the arrays and views of a burst that was looked at
"""

from __future__ import annotations

import fcntl
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import TextIOWrapper
from pathlib import Path
from types import TracebackType
from typing import Any

from core.backbones.base import Backbone
from core.errors import Conflict, NotFound, Unavailable
from store.archive import Export, export
from store.audit import Audit, record
from store.backup import Backup, back_up
from store.categories import Categories
from store.check import CheckReport, check
from store.connection import DATABASE, Connection
from store.corrections import Corrections
from store.folders import make_parents
from store.goals import Goals
from store.imports import Import, import_archive
from store.instances import Instances
from store.keys import Keys
from store.observations import Observations
from store.progress import Progress, untold
from store.records import AuditEntry, Errand
from store.reembed import Reembedded, reembed
from store.requests import Requests
from store.retention import Retention
from store.scans import Scans
from store.schema import outdated
from store.sessions import Sessions
from store.sizes import Sizes, sizes
from store.sweep import purge, seal, sweep
from store.undo import undo


class Memory:
    """An open memory; safe to use from several threads."""

    def __init__(self, connection: Connection, lock: TextIOWrapper | None) -> None:
        self._connection = connection
        self._lock = lock
        self.folder = connection.root
        self.instances = Instances(connection)
        self.categories = Categories(connection, self.instances)
        self.scans = Scans(connection)
        self.observations = Observations(connection)
        self.goals = Goals(connection, self.categories)
        self.requests = Requests(connection)
        self.audit = Audit(connection)
        self.keys = Keys(connection)
        self.sessions = Sessions(connection)
        self.corrections = Corrections(connection)

    @classmethod
    def open(cls, folder: Path, retention: Retention | None = None) -> Memory:
        """Opens the memory in `folder`, or makes an empty one; removes what a stopped process left half written.

        What is too old or too much for `retention` is removed too; without one nothing is, since only whoever keeps the memory knows.
        Raises Conflict where another process has it open, or a later version made it; Unavailable where it cannot be written.
        """
        lock = _lock(folder)
        try:
            connection = Connection(folder, retention)
        except BaseException:
            lock.close()
            raise
        try:
            seal(connection)
            memory = cls(connection, lock)
            memory.requests.recover()
            if retention is not None:
                memory.prune()
            sweep(connection)
        except BaseException:
            connection.close()
            lock.close()
            raise
        return memory

    @classmethod
    def reading(cls, folder: Path) -> Memory:
        """The memory in `folder` beside the process that has it open, or while none has: to look, check, back up and export.

        Changing it raises Unavailable. Raises NotFound where there is none, Conflict where a process of another version has it open.
        """
        cls.require(folder)
        if outdated(folder / DATABASE):
            cls.open(folder).close()
        return cls(Connection(folder, only_read=True), None)

    @classmethod
    @contextmanager
    def keyring(cls, folder: Path) -> Iterator[Keys]:
        """The keys of the memory in `folder`, to be made and revoked also while a service has it open. Makes an empty memory where none is.

        Raises Conflict where a process of another version has it open, Unavailable where it cannot be written.
        """
        if not (folder / DATABASE).is_file() or outdated(folder / DATABASE):
            cls.open(folder).close()
        connection = Connection(folder)
        try:
            yield Keys(connection)
        finally:
            connection.close()

    @staticmethod
    def require(folder: Path) -> None:
        """Raises NotFound where no memory is in `folder`."""
        if not (folder / DATABASE).is_file():
            raise NotFound(f"no memory is in {folder}; name its folder, or set ONELOOK_DATA_DIR")

    @property
    def version(self) -> int:
        """A number that grows with each change."""
        return int(self._meta("memory_version") or 0)

    @property
    def backbone(self) -> str | None:
        """Name of the backbone that this memory's tokens came from; None before the first."""
        return self._meta("backbone")

    @property
    def fingerprint(self) -> str | None:
        """Of that backbone's weights, layer and preprocessing."""
        return self._meta("fingerprint")

    def require_backbone(self, name: str, fingerprint: str) -> None:
        """Ties an empty memory to a backbone. Raises Conflict where it is tied to another, whose tokens cannot be compared."""
        kept = self.fingerprint
        if kept is None:
            with self._connection.change() as db:
                db.table("meta").insert_all([{"key": "backbone", "value": name}, {"key": "fingerprint", "value": fingerprint}])
        elif kept != fingerprint:
            raise Conflict(
                f"the memory in {self.folder} was made with backbone {self.backbone} (fingerprint {kept}), "
                f"this service uses {name} (fingerprint {fingerprint}): their tokens cannot be compared; "
                "start with the first backbone (ONELOOK_BACKBONE), keep another memory for this one (ONELOOK_DATA_DIR), "
                f"or compute the memory anew from its views with `onelook memory reembed --backbone {name}`"
            )

    def setting(self, name: str) -> Any:
        """What was kept under a name, None before; JSON, opaque here."""
        return json.loads(self._meta(f"setting:{name}") or "null")

    def keep_setting(self, name: str, value: Any) -> None:
        """Keeps JSON that belongs to what was learnt, such as a calibrated threshold."""
        with self._connection.change() as db:
            db.table("meta").insert({"key": f"setting:{name}", "value": json.dumps(value)}, replace=True)

    def note(self, errand: Errand, about: Mapping[str, Any], *, actor: str | None = None) -> None:
        """Adds to the audit trail what was done with the memory as a whole."""
        with self._connection.change() as db:
            record(db, errand, None, {}, about, actor)

    def undo(self, entry_id: str, *, actor: str | None = None) -> AuditEntry:
        """Takes back a change of the audit trail; returns the entry that says so.

        Raises NotFound, and Conflict where it cannot be undone (any more).
        """
        return self.audit.get(undo(self._connection, self.audit.get(entry_id), actor))

    def prune(self) -> None:
        """Ends what has an end: expired scans, observations over the limit, old request keys, sessions, removals too old to be undone."""
        self.scans.expire()
        self.observations.prune()
        self.requests.prune()
        self.sessions.prune()
        purge(self._connection)

    def check(self, progress: Progress = untold) -> CheckReport:
        """Reads everything once, and names what is damaged and what still works."""
        return check(self._connection, progress)

    def sizes(self) -> Sizes:
        """How much there is."""
        return sizes(self._connection)

    def backup(self, folder: Path, progress: Progress = untold) -> Backup:
        """Copies the memory, while it is used, to a folder that does not exist yet. Raises Conflict and Unavailable."""
        return back_up(self._connection, folder, progress)

    def export(self, path: Path, category_ids: Sequence[str] | None = None, progress: Progress = untold) -> Export:
        """Writes categories, all of them where none are named, to a file that does not exist yet. `progress` counts categories.

        Raises NotFound, Conflict where the file exists or there is nothing to export, Unavailable where something is damaged.
        """
        return export(self._connection, self.categories, path, category_ids, progress)

    def import_archive(self, path: Path, *, actor: str | None = None, progress: Progress = untold) -> Import:
        """Takes the categories of another memory's export, all of them or none; those it has already are left as they are.

        `progress` counts categories. Raises InvalidInput where the archive is not in order, Conflict where it was made with another
        backbone or is imported meanwhile, Unavailable where it cannot be read or kept.
        """
        result = import_archive(self._connection, self.categories, path, actor=actor, progress=progress)
        seal(self._connection)  # an earlier version may have written it
        self.instances.reload()
        return result

    def reembed(self, backbone: Backbone, *, actor: str | None = None, progress: Progress = untold) -> Reembedded:
        """Computes everything anew from the kept views, with another backbone or again with the same, and then ties the memory to it.

        Either all of it happens or nothing does. Instances whose views are no longer kept are dropped where the backbone is another one,
        and so are settings, which were calibrated with the first; nor do its decisions count for later ones. `progress` counts categories
        and observations.

        Raises Unavailable where a category cannot be computed.
        """
        result = reembed(self._connection, backbone, actor=actor, progress=progress)
        self.instances.reload()
        return result

    def require_sound(self) -> None:
        """Raises Unavailable where the memory cannot be read, or could not be written the last time and still cannot."""
        self._connection.require_sound()

    def close(self) -> None:
        """Closes the file and lets other processes in."""
        self._connection.close()
        if self._lock is not None:
            self._lock.close()

    def __enter__(self) -> Memory:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _meta(self, key: str) -> str | None:
        row = self._connection.row("SELECT value FROM meta WHERE key = ?", key)
        return str(row["value"]) if row else None


def _lock(folder: Path) -> TextIOWrapper:
    """Keeps other processes out until it is closed, also by the end of this one."""
    try:
        make_parents(folder / "lock")
        lock = (folder / "lock").open("w")
    except OSError as error:
        raise Unavailable(f"cannot open the memory in {folder}: {error}; set ONELOOK_DATA_DIR to a folder that can be written") from error
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        lock.close()
        raise Conflict(f"the memory in {folder} is open in another process; stop that one, or set another ONELOOK_DATA_DIR") from None
    return lock
