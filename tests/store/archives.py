"""Archives of categories, taken apart and put together otherwise."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from store.folders import FileSum

Entries = dict[str, bytes]


def unpacked(archive: Path) -> Entries:
    """What is in an archive, by name."""
    with zipfile.ZipFile(archive) as file:
        return {name: file.read(name) for name in file.namelist()}


def packed(path: Path, entries: Entries, method: int = zipfile.ZIP_STORED) -> Path:
    """An archive of these entries."""
    with zipfile.ZipFile(path, "w", method) as file:
        for name, content in entries.items():
            file.writestr(name, content)
    return path


def with_manifest(entries: Entries, change: Callable[[dict], object]) -> Entries:
    """The same archive with another manifest."""
    manifest = json.loads(entries["manifest.json"])
    change(manifest)
    return entries | {"manifest.json": json.dumps(manifest).encode()}


def with_entry(entries: Entries, name: str, content: bytes) -> Entries:
    """The same archive with another entry, of which the manifest tells the truth."""
    _, category_id, file = (*name.split("/"), "")[:3]

    def tell(manifest: dict) -> None:
        about = {"size": len(content), "sha256": FileSum.of(content).sha256}
        for part in manifest["categories"]:
            if name == f"tokens/{part['id']}.npz":
                part["tokens"] = about
            elif part["id"] == category_id:
                part["files"][file] = about

    return with_manifest(entries | {name: content}, tell)


def npz(**arrays: np.ndarray) -> bytes:
    """As a file."""
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()
