"""Arrays as bytes: one npz file with a checksum, or one BLOB in a row. Nothing is ever pickled."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from store.folders import Files, FileSum, read_whole

Array = NDArray[Any]
BLOB_TYPE = np.dtype("<f4")
"""Tokens are kept as they were computed: rounding them would make a restarted service decide otherwise."""
PART_TYPE = np.dtype("<f2")
"""Parts are made in half precision."""


def write_arrays(path: Path, arrays: Mapping[str, Array]) -> str:
    """Writes one npz file and returns its SHA-256 in hex."""
    buffer = io.BytesIO()
    # The keyword arguments of np.savez are array names, so one called "file" or "allow_pickle" cannot be kept this way.
    np.savez(buffer, allow_pickle=False, **arrays)
    content = buffer.getvalue()
    path.write_bytes(content)
    return FileSum.of(content).sha256


def read_arrays(path: Path, sha256: str) -> dict[str, Array]:
    """The arrays of one npz file. Raises as `read_whole` does."""
    with np.load(io.BytesIO(read_whole(path, sha256)), allow_pickle=False) as npz:
        return dict(npz)


def arrays_file(files: Files) -> tuple[str, FileSum]:
    """The one npz file of a folder, the rest being pictures; its name changes with the backbone."""
    return next((name, file) for name, file in files.items() if name.endswith(".npz"))


def tokens_to_blob(tokens: NDArray[np.floating]) -> bytes:
    """One token a view, shape (V, D), as bytes."""
    return np.ascontiguousarray(tokens, dtype=BLOB_TYPE).tobytes()


def tokens_from_blob(blob: bytes, views: int) -> NDArray[np.float32]:
    """The tokens of `tokens_to_blob`, shape (views, D)."""
    return np.frombuffer(blob, BLOB_TYPE).reshape(views, -1).astype(np.float32, copy=False)


def parts_to_blob(parts: NDArray[np.floating]) -> bytes:
    """Tokens of parts, shape (V, K, D), as bytes."""
    return np.ascontiguousarray(parts, dtype=PART_TYPE).tobytes()


def parts_from_blob(blob: bytes, views: int, dim: int) -> NDArray[np.floating]:
    """The tokens of `parts_to_blob`, shape (views, K, dim)."""
    return np.frombuffer(blob, PART_TYPE).reshape(views, -1, dim)
