"""What happens in the service, as server-sent events (WHATWG HTML, 9.2)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

PATH = "/v1/events"


@dataclass(frozen=True)
class Event:
    """One thing that happened."""

    id: int
    """To go on from, after a connection broke."""
    kind: str
    """`observation`, `category_created` and the like; `dropped` says how many events were left out."""
    created_at: str
    """ISO 8601, UTC."""
    about: Mapping[str, Any]
    """Ids and names."""


@dataclass
class EventReader:
    """Puts lines together: an event ends with an empty line."""

    _fields: dict[str, str] = field(default_factory=dict)

    def feed(self, line: str) -> Event | None:
        """The event that `line`, without its end, completes."""
        if line:
            name, _, value = line.partition(":")
            value = value.removeprefix(" ")
            self._fields[name] = f"{self._fields[name]}\n{value}" if name == "data" and name in self._fields else value
            return None
        read, self._fields = self._fields, {}
        if "data" not in read:  # a comment that keeps the connection open
            return None
        about = json.loads(read["data"])
        return Event(int(read.get("id", 0)), read.get("event", "message"), about.pop("created_at", ""), about)
