"""Folders that exist whole or not at all."""

from __future__ import annotations

import os
import shutil
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

PARTIAL = ".partial-"
"""Prefix of a folder that is still being written."""


@contextmanager
def new_folder(final: Path) -> Iterator[Path]:
    """A folder to write into; it gets the name `final` once everything in it is on the disk, and is removed on an error."""
    partial = final.with_name(PARTIAL + final.name)
    partial.mkdir(parents=True)
    try:
        yield partial
        for path in (*partial.iterdir(), partial):
            _sync(path)
        partial.rename(final)
        _sync(final.parent)
    except BaseException:
        shutil.rmtree(partial, ignore_errors=True)
        raise


def remove_orphans(parent: Path, known: Collection[str]) -> list[str]:
    """Removes the folders of `parent` that are not `known`, which a stopped process left behind; returns their names."""
    if not parent.is_dir():
        return []
    orphans = sorted(path.name for path in parent.iterdir() if path.name not in known)
    for name in orphans:
        shutil.rmtree(parent / name, ignore_errors=True)
    return orphans


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
