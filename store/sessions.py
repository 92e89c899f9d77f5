"""Sessions of people who signed in to the console with a key; each lasts some hours, and no longer than its key."""

from __future__ import annotations

import secrets
from datetime import timedelta

from store.connection import Connection
from store.keys import Key, key_of, sha256_of
from store.times import ahead, now

BYTES = 32


class Sessions:
    """The sessions of one memory. Only hashes are kept, as of keys."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def begin(self, key: Key, span: timedelta) -> str:
        """What the browser sends from now on, for so long."""
        token = secrets.token_urlsafe(BYTES)
        row = {"sha256": sha256_of(token), "key_id": key.id, "created_at": now(), "expires_at": ahead(span)}
        with self._connection.housekeeping() as db:
            db.table("sessions").insert(row)
        return token

    def find(self, token: str) -> Key | None:
        """The key that a session began with, while both are valid.

        The token is looked up by its hash: how long that takes tells of the hash, which nobody can choose.
        """
        query = "SELECT k.* FROM sessions s JOIN keys k ON k.id = s.key_id WHERE s.sha256 = ? AND s.expires_at > ? AND k.revoked_at IS NULL"
        row = self._connection.row(query, sha256_of(token), now())
        return key_of(row) if row else None

    def end(self, token: str) -> None:
        """Signs out."""
        with self._connection.housekeeping() as db:
            db.execute("DELETE FROM sessions WHERE sha256 = ?", [sha256_of(token)])

    def prune(self) -> None:
        """Forgets those that are over."""
        with self._connection.housekeeping() as db:
            db.execute("DELETE FROM sessions WHERE expires_at <= ?", [now()])
