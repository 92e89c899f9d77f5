"""API keys: who may ask the service for what. Only hashes are kept, so that a copied memory gives no key away.

A key reads `onelook_ID_SECRET`. Its secret has 256 random bits, which nobody can try out: one pass of SHA-256 is enough, where a
password would take a slow hash.
"""

from __future__ import annotations

import hashlib
import hmac
import secrets
from dataclasses import dataclass
from typing import Literal, get_args

from core.errors import Conflict, InvalidInput, NotFound
from store.audit import record
from store.connection import Connection, Row
from store.times import now

Role = Literal["viewer", "robot", "admin"]
"""Each may do what the ones before it may."""
ROLES: tuple[Role, ...] = get_args(Role)
PREFIX = "onelook"
SECRET_BYTES = 32
LONGEST_NAME = 100
NOBODY = hashlib.sha256(b"").hexdigest()
"""Compared with where no key has the id, so that the answer takes as long."""


@dataclass(frozen=True)
class Key:
    """A key, without its secret."""

    id: str
    name: str
    role: Role
    created_at: str
    revoked_at: str | None


class Keys:
    """The keys of one memory."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def create(self, name: str, role: Role, *, actor: str | None = None) -> tuple[Key, str]:
        """A new key, and the text that its owner sends: it cannot be told again.

        Raises InvalidInput for a name that cannot be shown in one line, Conflict where another key has it.
        """
        if not name.strip() or len(name) > LONGEST_NAME or not name.isprintable():
            raise InvalidInput("name", f"is {name!r}; give 1 to {LONGEST_NAME} printable characters that say who has the key")
        if role not in ROLES:
            raise InvalidInput("role", f"is {role!r}; the roles are {', '.join(ROLES)}")
        secret = secrets.token_urlsafe(SECRET_BYTES)
        key = Key(secrets.token_hex(6), name, role, now(), None)
        with self._connection.change() as db:
            if any(each.name == name for each in self.all()):
                raise Conflict(f"a key is called {name!r} already; revoke it first (onelook keys list), or give another name")
            row = {"id": key.id, "name": name, "role": role, "created_at": key.created_at, "sha256": sha256_of(secret)}
            db.table("keys").insert(row)
            record(db, "key", None, {}, {"key": key.id, "name": name, "role": role}, actor)
        return key, f"{PREFIX}_{key.id}_{secret}"

    def all(self) -> list[Key]:
        """Those that are valid, oldest first."""
        return [key_of(row) for row in self._connection.rows("SELECT * FROM keys WHERE revoked_at IS NULL ORDER BY rowid")]

    def revoke(self, key_id: str, *, actor: str | None = None) -> Key:
        """Nobody is let in with it from now on, nor with a session that began with it. Raises NotFound."""
        with self._connection.change() as db:
            key = next((each for each in self.all() if each.id == key_id), None)
            if key is None:
                raise NotFound(f"no key that is valid has the id {key_id!r}; `onelook keys list` shows them")
            revoked = Key(key.id, key.name, key.role, key.created_at, now())
            db.execute("UPDATE keys SET revoked_at = ? WHERE id = ?", [revoked.revoked_at, key_id])
            db.execute("DELETE FROM sessions WHERE key_id = ?", [key_id])
            record(db, "revoke", None, {"key": key.id, "name": key.name, "role": key.role}, {}, actor)
        return revoked

    def required(self) -> bool:
        """Whether there ever was a key: revoking the last one locks the door, it does not open it."""
        return bool(self._connection.rows("SELECT 1 FROM keys LIMIT 1"))

    def find(self, text: str) -> Key | None:
        """The valid key that reads so. How long it takes tells nothing of how much of the secret is right."""
        prefix, _, rest = text.partition("_")
        key_id, _, secret = rest.partition("_")
        row = self._connection.row("SELECT * FROM keys WHERE id = ? AND revoked_at IS NULL", key_id)
        right = hmac.compare_digest(sha256_of(secret), row["sha256"] if row else NOBODY)
        return key_of(row) if row and right and prefix == PREFIX else None


def sha256_of(secret: str) -> str:
    """What is kept of a secret."""
    return hashlib.sha256(secret.encode(errors="replace")).hexdigest()


def key_of(row: Row) -> Key:
    """From its row."""
    return Key(row["id"], row["name"], row["role"], row["created_at"], row["revoked_at"])
