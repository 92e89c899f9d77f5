"""Requests that may be repeated: a robot that got no answer asks again with the same key, and nothing is done twice.

The key's row is there before the work begins, and learns what the work made in the very transaction that makes it. So a process
killed between the change and its answer still knows, at the repetition, that it was done.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from core.errors import Conflict
from store.connection import Connection, running_request
from store.times import ago, now


class StillRunning(Conflict):
    """The first request with a key is not answered yet."""


@dataclass(frozen=True)
class Reply:
    """An answer, as it went out."""

    status: int
    media_type: str
    body: bytes


@dataclass(frozen=True)
class Earlier:
    """That a request was carried out before."""

    reply: Reply | None
    """None where the process ended after the change and before the answer."""
    result_id: str | None
    """Of what it made or changed, where it changed anything."""


@dataclass
class Once:
    """One request: either it was carried out `earlier`, or the caller does so now and leaves the `reply`."""

    earlier: Earlier | None
    reply: Reply | None = None


@contextmanager
def unnoted() -> Iterator[None]:
    """What is changed inside is not yet what the request is for: a process that ends before that begins the request anew."""
    token = running_request.set(None)
    try:
        yield
    finally:
        running_request.reset(token)


class Requests:
    """The repeatable requests of one memory."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._lock = threading.Lock()
        self._running: set[tuple[str, str]] = set()

    @contextmanager
    def once(self, key: str, route: str, digest: str) -> Iterator[Once]:
        """What is done inside counts as done for `key` on `route`; `digest` is the body's.

        Raises Conflict where the key came with another body, StillRunning where its first request is not answered yet.
        """
        request = (key, route)
        with self._lock:
            if request in self._running:
                raise StillRunning(f"the request with Idempotency-Key {key!r} is still being answered; repeat it later")
            earlier = self._begin(key, route, digest)
            if earlier is None:
                self._running.add(request)
        if earlier is not None:
            yield Once(earlier)
            return
        token = running_request.set(request)
        once = Once(None)
        try:
            yield once
        finally:
            running_request.reset(token)
            try:
                self._end(key, route, once.reply)
            finally:
                with self._lock:
                    self._running.discard(request)

    def recover(self) -> None:
        """Forgets requests that a stopped process began and that changed nothing: they may be sent again."""
        with self._connection.housekeeping() as db:
            db.execute("DELETE FROM requests WHERE status IS NULL AND result_id IS NULL")

    def prune(self) -> None:
        """Forgets keys that are older than the retention says."""
        with self._connection.housekeeping() as db:
            db.execute("DELETE FROM requests WHERE created_at <= ?", [ago(self._connection.retention.requests)])

    def _begin(self, key: str, route: str, digest: str) -> Earlier | None:
        row = self._connection.row("SELECT * FROM requests WHERE key = ? AND route = ?", key, route)
        if row is not None and row["created_at"] > ago(self._connection.retention.requests):
            if row["digest"] != digest:
                raise Conflict(f"Idempotency-Key {key!r} was used for another request; take a new key for each request")
            if row["status"] is not None:
                return Earlier(Reply(row["status"], row["media_type"], row["body"]), row["result_id"])
            if row["result_id"] is not None:
                return Earlier(None, row["result_id"])
        with self._connection.housekeeping() as db:
            db.table("requests").insert({"key": key, "route": route, "digest": digest, "created_at": now()}, replace=True)
        return None

    def _end(self, key: str, route: str, reply: Reply | None) -> None:
        with self._connection.housekeeping() as db:
            if reply is None:
                db.execute("DELETE FROM requests WHERE key = ? AND route = ? AND result_id IS NULL", [key, route])
            else:
                update = "UPDATE requests SET status = ?, media_type = ?, body = ? WHERE key = ? AND route = ?"
                db.execute(update, [reply.status, reply.media_type, reply.body, key, route])
