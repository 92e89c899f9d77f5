"""How much is kept, and for how long."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import timedelta

from core.errors import InvalidInput


@dataclass(frozen=True)
class Retention:
    """Limits of one memory. What was learnt has none: only what was seen, and what was thrown away, comes to an end."""

    observations: int = 1000
    """Most observations kept; each is some megabytes of views. The oldest goes, with its views, when one more is kept."""
    undo: timedelta = timedelta(days=30)
    """How long a rename, merge, split, correction, forgetting or deletion can be undone; then what it removed is removed for good."""
    scans: timedelta = timedelta(hours=24)
    """A scan that no views come for expires after this."""
    requests: timedelta = timedelta(hours=24)
    """How long a repeated request is recognised by its key."""

    def __post_init__(self) -> None:
        if self.observations < 1:
            raise InvalidInput("observations", f"found {self.observations}, expected at least 1 to keep")
