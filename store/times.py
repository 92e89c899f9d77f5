"""Times as the memory keeps them: UTC in ISO 8601, so that later ones sort later."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone


def now() -> str:
    """The present."""
    return _text(datetime.now(timezone.utc))


def ago(span: timedelta) -> str:
    """What `now` was that long ago."""
    return _text(datetime.now(timezone.utc) - span)


def ahead(span: timedelta) -> str:
    """What `now` will be after that long."""
    return _text(datetime.now(timezone.utc) + span)


def _text(time: datetime) -> str:
    return time.isoformat(timespec="milliseconds")
