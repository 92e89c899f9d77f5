"""Who asks, and whether they may: a request is let in before anything else of it is read, answered from a cache, or done.

Who has no key can only be let in while there never was one, which takes a service that no other machine reaches.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from ipaddress import ip_address

from anyio.to_thread import run_sync
from starlette.requests import HTTPConnection

from service.access import ADMIN, allows, needed_role
from service.logs import robot
from service.rate import RateLimit
from service.refusals import NoKey, NotAllowed, TooOften
from store.keys import Key, Keys, Role
from store.sessions import Sessions

COOKIE = "onelook_session"
LONGEST_ACTOR = 200
HOW = "send the header `Authorization: Bearer KEY` (ONELOOK_API_KEY for the client and the commands)"


@dataclass(frozen=True)
class Caller:
    """Who asks."""

    name: str | None
    """Of their key; None where there are no keys."""
    role: Role

    def may(self, needed: Role) -> bool:
        """Whether they may do what takes this role."""
        return allows(self.role, needed)

    def may_call(self, operation: str) -> bool:
        """Whether they may do this operation of `service.access`."""
        needed = needed_role(operation)
        return needed is None or self.may(needed)

    def as_actor(self, said: str | None) -> str | None:
        """For the audit trail: the key's name, which is sure, before what they say of themselves, which is not."""
        return f"{self.name} ({said})" if self.name and said else self.name or said


ANYBODY = Caller(None, ADMIN)


class Guard:
    """Of one application."""

    def __init__(self, keys: Keys, sessions: Sessions, per_minute: int, *, asks: bool = True) -> None:
        """`asks` is False for a service that only its own process reaches."""
        self._keys = keys
        self._sessions = sessions
        self._rate = RateLimit(per_minute)
        self._per_minute = per_minute
        self._asks = asks

    async def admit(self, connection: HTTPConnection, needed: Role | None) -> None:
        """Puts the caller in the connection's state. Raises NoKey, NotAllowed, TooOften."""
        if needed is None:
            return
        key = await run_sync(self._key, connection) if self._asks else None
        if key is not None:
            self._require_rate(key)
        caller = Caller(key.name, key.role) if key else ANYBODY
        connection.state.caller = caller
        robot.set(caller.as_actor(connection.headers.get("x-actor", "")[:LONGEST_ACTOR]) or None)
        if not caller.may(needed):
            raise NotAllowed(f"the key {caller.name!r} has the role {caller.role}, this takes {needed}; ask for another key")

    def _key(self, connection: HTTPConnection) -> Key | None:
        """None where there never was a key."""
        sent = connection.headers.get("authorization")
        session = connection.cookies.get(COOKIE)
        if sent is not None:
            key = self._keys.find(_bearer(sent))
            if key is not None:
                return key
        elif session is not None and (key := self._sessions.find(session)) is not None:
            return key
        if self._keys.required():
            raise NoKey(f"this service asks for a key; {HOW}" if sent is None else "the key is none of this service, or was revoked")
        _require_own_name(connection)
        return None

    def _require_rate(self, key: Key) -> None:
        wait_s = math.ceil(self._rate.take(key.id))
        if wait_s:
            limit = f"{self._per_minute} requests a minute (ONELOOK_RATE_LIMIT)"
            raise TooOften(f"the key {key.name!r} has used up its {limit}; ask again in {wait_s} s", wait_s)


def _bearer(header: str) -> str:
    scheme, _, key = header.partition(" ")
    if scheme.lower() != "bearer":
        raise NoKey(f"Authorization says {scheme!r}; {HOW}")
    return key.strip()


def _require_own_name(connection: HTTPConnection) -> None:
    """Raises NotAllowed for a name that somebody else's page may have given this address, to be let in as if it were the service's own.

    Such a page (DNS rebinding) needs a public name, which has a dot in it.
    """
    name = connection.url.hostname or ""
    if "." not in name or name.endswith((".localhost", ".local")):
        return
    try:
        ip_address(name)
    except ValueError:
        raise NotAllowed(f"asked for as {name!r} this service wants a key, since any web page can send you here; {HOW}") from None
