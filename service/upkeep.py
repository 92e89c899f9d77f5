"""The memory as a whole: backups, and what comes from other memories."""

from __future__ import annotations

import tempfile
from datetime import datetime, timezone
from pathlib import Path

from service.events import Events
from store.backup import Backup
from store.imports import Import
from store.memory import Memory


class Upkeep:
    """Of one memory."""

    def __init__(self, memory: Memory, events: Events) -> None:
        self._memory = memory
        self._events = events

    def backup(self, parent: Path) -> Backup:
        """Copies the memory, while it is used, to a new folder in `parent`, called by time and version. Raises Conflict and Unavailable."""
        taken_at = datetime.now(timezone.utc).strftime("%Y%m%dT%H%M%S.%fZ")
        return self._memory.backup(parent / f"{taken_at}-v{self._memory.version}")

    def import_archive(self, archive: bytes, *, actor: str | None = None) -> Import:
        """Takes in the categories of another memory. Raises InvalidInput and Conflict, and nothing is taken in then."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "memory.zip"
            path.write_bytes(archive)
            brought = self._memory.import_archive(path, actor=actor)
        self._events.publish("memory_imported", ids=[category.id for category in brought.categories])
        return brought
