"""Faults of the machine below the store, for tests: a disk that fails, is full or slow, a process that ends, a power cut.

Everything the store writes goes through a few calls (write, fsync, mkdir, rename, remove, begin and commit of a transaction). A `Disk`
stands before them, for one folder: it counts them, and does at any of them what it is told. After a crash nothing reaches the folder any
more, so that no `finally` tidies up what a dead process could not have.
"""

from __future__ import annotations

import errno
import os
import shutil
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest import mock

Fault = Callable[[str, Path], None]
"""Told of each call before it is made, by its kind and path; may raise, or wait."""
TORN = 0.5
"""Share of a write that is on the disk when the process ends within it."""


class Crash(BaseException):
    """The process ended here."""


@dataclass
class Disk:
    """What is below one folder."""

    root: Path
    fault: Fault = lambda kind, path: None
    crash_at: int | None = None
    """At the so manieth call the process ends."""
    calls: int = 0
    crashed: bool = False
    kinds: list[str] = field(default_factory=list)
    """Of the calls so far."""
    _unsynced: list[tuple[str, Path, Path]] = field(default_factory=list)
    """What a power cut takes back, oldest first: kind, path, and where it was before."""
    _attic: list[Path] = field(default_factory=list)

    def reached(self, kind: str, path: Path) -> bool:
        """Before each call; False where it is none of this disk's. Raises what the fault does, and Crash."""
        if not path.is_relative_to(self.root):
            return False
        if self.crashed:
            raise Crash
        self.calls += 1
        self.kinds.append(kind)
        if self.calls == self.crash_at:
            self.crashed = True
            raise Crash
        self.fault(kind, path)
        return True

    def changed(self, kind: str, path: Path, before: Path | None = None) -> None:
        """After a call that the disk need not have done yet."""
        self._unsynced.append((kind, path, before or path))

    def synced(self, path: Path) -> None:
        """A file's content, or a folder's names, are on the disk."""
        self._unsynced = [
            each for each in self._unsynced if not (each[1] == path if each[0] == "content" else path in (each[1].parent, each[2].parent))
        ]

    def keep(self, path: Path) -> None:
        """Puts aside what is removed: until its folder is synced, a power cut brings it back."""
        attic = self.root.with_name(f"{self.root.name}-attic") / str(len(self._attic))
        attic.mkdir(parents=True)
        os.rename(path, attic / path.name)
        self._attic.append(attic / path.name)
        self._unsynced.append(("removed", path, attic / path.name))

    def arm(self, crash_at: int | None) -> None:
        """Counts anew, and crashes at that call."""
        self.calls, self.kinds, self.crash_at = 0, [], crash_at

    def move(self, root: Path) -> None:
        """Stands before another folder from now on."""
        for gone in (self.root, self.root.with_name(f"{self.root.name}-attic")):
            self.root, self.crashed = root, False
            shutil.rmtree(gone, ignore_errors=True)
        self._unsynced, self._attic = [], []
        self.arm(None)

    def left(self, to: Path, *, power_cut: bool) -> Path:
        """Copies the folder as the crash left it; a power cut also takes back whatever was never synced."""
        shutil.copytree(self.root, to)
        for kind, path, before in reversed(self._unsynced if power_cut else []):
            here = to / path.relative_to(self.root)
            if kind == "removed":
                if here.parent.is_dir() and not here.exists():
                    (shutil.copytree if before.is_dir() else shutil.copyfile)(before, here)
            elif kind == "renamed":
                if here.exists():
                    os.rename(here, to / before.relative_to(self.root))
            elif kind == "content":
                if here.is_file():
                    os.truncate(here, int(TORN * here.stat().st_size))
            elif here.is_dir():
                shutil.rmtree(here)
            elif here.exists():
                here.unlink()
        return to


@contextmanager
def tapped(disk: Disk) -> Iterator[Disk]:
    """While this lasts the disk is before every call below its folder."""
    real: dict[str, Any] = {
        name: getattr(owner, name.rpartition(".")[2])
        for name, owner in (
            ("Path.write_bytes", Path),
            ("Path.write_text", Path),
            ("Path.mkdir", Path),
            ("Path.rename", Path),
            ("Path.unlink", Path),
            ("os.fsync", os),
            ("shutil.rmtree", shutil),
            ("sqlite3.connect", sqlite3),
        )
    }

    def write(self: Path, content: bytes) -> int:
        if not _reached(disk, "write", self, lambda: real["Path.write_bytes"](self, content[: int(TORN * len(content))])):
            return int(real["Path.write_bytes"](self, content))
        new = not self.exists()
        written = real["Path.write_bytes"](self, content)
        disk.changed("content", self)
        if new:
            disk.changed("made", self)
        return int(written)

    def mkdir(self: Path, *args: Any, **options: Any) -> None:
        ours = disk.reached("mkdir", self) if not self.exists() else False
        real["Path.mkdir"](self, *args, **options)
        if ours:
            disk.changed("made", self)

    def rename(self: Path, target: Path) -> Path:
        ours = disk.reached("rename", self)
        moved: Path = real["Path.rename"](self, target)
        if ours:
            disk.changed("renamed", Path(target), self)
        return moved

    def unlink(self: Path, *args: Any, **options: Any) -> None:
        if self.exists() and disk.reached("remove", self):
            disk.keep(self)
        else:
            real["Path.unlink"](self, *args, **options)

    def rmtree(path: Path, *args: Any, **options: Any) -> None:
        if Path(path).exists() and disk.reached("remove", Path(path)):
            disk.keep(Path(path))
        else:
            real["shutil.rmtree"](path, *args, **options)

    def fsync(descriptor: int) -> None:
        path = Path(os.readlink(f"/proc/self/fd/{descriptor}"))
        disk.reached("fsync", path)
        real["os.fsync"](descriptor)
        disk.synced(path)

    class Tapped(sqlite3.Connection):
        """Begin and commit are calls too; SQLite itself syncs what it commits."""

        def execute(self, sql: str, *parameters: Any) -> sqlite3.Cursor:
            if sql in ("BEGIN", "COMMIT"):
                disk.reached(sql.lower(), disk.root)
            cursor = super().execute(sql, *parameters)
            if sql == "COMMIT":
                disk.reached("committed", disk.root)
            return cursor

        def rollback(self) -> None:
            if disk.crashed:
                raise Crash
            super().rollback()

    def connect(database: Any, *args: Any, **options: Any) -> sqlite3.Connection:
        if Path(str(database)).is_relative_to(disk.root):
            options["factory"] = Tapped
        connection: sqlite3.Connection = real["sqlite3.connect"](database, *args, **options)
        return connection

    put: dict[str, Any] = {
        "Path.write_bytes": write,
        "Path.write_text": lambda self, text, **options: write(self, text.encode()),
        "Path.mkdir": mkdir,
        "Path.rename": rename,
        "Path.unlink": unlink,
        "os.fsync": fsync,
        "shutil.rmtree": rmtree,
        "sqlite3.connect": connect,
    }
    owners = {"Path": Path, "os": os, "shutil": shutil, "sqlite3": sqlite3}
    with ExitStack() as patches:
        for name, function in put.items():
            owner, _, attribute = name.partition(".")
            patches.enter_context(mock.patch.object(owners[owner], attribute, function))
        yield disk


def _reached(disk: Disk, kind: str, path: Path, tear: Callable[[], object]) -> bool:
    """As `Disk.reached`, for a call that a crash can end halfway."""
    dead = disk.crashed
    try:
        return disk.reached(kind, path)
    except Crash:
        if not dead:
            tear()
        raise


def failing(error: int, *kinds: str) -> Fault:
    """Calls of these kinds fail with an errno; what fails within SQLite is reported as SQLite does."""

    def fault(kind: str, path: Path) -> None:
        if kind not in kinds:
            return
        if kind in {"begin", "commit"}:
            raise sqlite3.OperationalError("database or disk is full" if error == errno.ENOSPC else "disk I/O error")
        raise OSError(error, os.strerror(error), str(path))

    return fault
