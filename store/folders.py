"""Folders that exist whole or not at all, and what their files were when they were written."""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from core.errors import Unavailable

PARTIAL = ".partial-"
"""Prefix of a folder or file that is still being written."""


@dataclass(frozen=True)
class FileSum:
    """What a file was when it was written."""

    size: int
    """Bytes."""
    sha256: str

    @staticmethod
    def of(content: bytes) -> FileSum:
        """Of a file with this content."""
        return FileSum(len(content), hashlib.sha256(content).hexdigest())


Files = Mapping[str, FileSum]
"""The files of a folder, by name; every array and every picture is in it."""


def partial_of(final: Path) -> Path:
    """Where a folder or file is until it is whole."""
    return final.with_name(PARTIAL + final.name)


@contextmanager
def new_folder(final: Path) -> Iterator[Path]:
    """A folder to write into; it gets the name `final` once everything in it is on the disk, and is removed on an error."""
    partial = partial_of(final)
    make_parents(partial)
    partial.mkdir()
    try:
        yield partial
        for path in (*partial.iterdir(), partial):
            sync(path)
        partial.rename(final)
        sync(final.parent)
    except BaseException:
        shutil.rmtree(partial, ignore_errors=True)
        raise


def make_parents(path: Path) -> None:
    """Makes the folders that lead to `path`; each is on the disk with its name before anything is in it."""
    for parent in reversed(path.parents):
        if not parent.exists():
            parent.mkdir(exist_ok=True)
            sync(parent.parent)


def sync(path: Path) -> None:
    """Returns once a file's content, or a folder's list of names, is on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def sums(folder: Path) -> dict[str, FileSum]:
    """What the files of a folder are now, by name."""
    return {path.name: FileSum.of(path.read_bytes()) for path in sorted(folder.iterdir())}


def read_whole(path: Path, sha256: str) -> bytes:
    """What was written to a file. Raises Unavailable where it is missing, cannot be read, or is not what was written."""
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise Unavailable(f"{path} is missing from the memory; restore it from a backup") from None
    except OSError as error:
        raise Unavailable(f"{path} cannot be read: {error.strerror}; check the disk, or restore it from a backup") from error
    found = FileSum.of(content).sha256
    if found != sha256:
        raise Unavailable(f"{path} is damaged: its SHA-256 is {found[:12]}…, {sha256[:12]}… was written; restore it from a backup")
    return content


def problem(path: Path, expected: FileSum) -> str | None:
    """What is wrong with a file, None where it is what was written."""
    try:
        found = FileSum.of(path.read_bytes())
    except FileNotFoundError:
        return "is missing"
    except OSError as error:
        return f"cannot be read: {error.strerror}"
    if found.size != expected.size:
        return f"has {found.size} bytes, {expected.size} were written"
    return None if found == expected else f"has SHA-256 {found.sha256[:12]}…, {expected.sha256[:12]}… was written"


def remove_orphans(parent: Path, known: Collection[str]) -> None:
    """Removes what is in `parent` and not `known`, which a stopped process left behind."""
    if not parent.is_dir():
        return
    for path in [path for path in parent.iterdir() if path.name not in known]:
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)
