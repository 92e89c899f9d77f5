"""What a benchmark computed once and keeps in the user's cache: named by the code it came from, and written whole or not at all."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import IO, Any

import core


@cache
def code_hash(sources: tuple[str, ...]) -> str:
    """Of the files of core/ that match the patterns: changed code never meets what older code computed."""
    root = Path(core.__file__).parent
    found = [source for pattern in sources for source in sorted(root.glob(pattern))]
    return hashlib.sha256(b"\0".join(source.read_bytes() for source in found)).hexdigest()


def write(file: Path, save: Callable[[IO[bytes]], Any]) -> None:
    """What `save` writes, at once under its name, so that a process stopped meanwhile leaves nothing that looks finished."""
    file.parent.mkdir(parents=True, exist_ok=True)
    partial = file.with_suffix(f".{os.getpid()}.partial")
    with partial.open("wb") as stream:
        save(stream)
    partial.replace(file)
