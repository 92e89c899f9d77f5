"""Bounds what requests may send: how much each, how much all of them together, and how long it may take to come."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Mapping

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

FILES = ("multipart/form-data", "application/x-npz", "application/zip")
"""Media types of bodies that carry images or archives."""
MAX_TEXT_BYTES = 4_000_000
"""Of every other body: it is parsed whole, and takes many times its size then."""
RETRY_S = 5
MB = 1_000_000


class BodyLimits:
    """Stops a request whose body grows too large or comes too slowly, whatever its headers said."""

    def __init__(self, app: ASGIApp, max_mb: int, bodies: int, deadline_s: float) -> None:
        """At most as many bytes are held at once as `bodies` of the largest size have."""
        self._app = app
        self._max_mb = max_mb
        self._most_held = bodies * max_mb * MB
        self._deadline_s = deadline_s
        self._held = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One connection. What is raised is raised within the route that reads the body, so it becomes a problem like every other error."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        started, size, complete = time.monotonic(), 0, False
        most = self._most(scope)

        async def counted() -> Message:
            nonlocal size, complete
            if complete:  # what comes now is the end of the connection, which has time
                return await receive()
            try:
                message = await asyncio.wait_for(receive(), max(0.0, started + self._deadline_s - time.monotonic()))
            except asyncio.TimeoutError:
                raise HTTPException(503, f"the body did not arrive within {self._deadline_s:g} s (ONELOOK_DEADLINE_S)") from None
            complete = not message.get("more_body", False)
            size += len(message.get("body", b""))
            self._held += len(message.get("body", b""))
            if size > most:
                raise HTTPException(413, self._too_large(most))
            if self._held > self._most_held:
                detail = f"the bodies of requests have {self._held // MB} MB together (ONELOOK_QUEUE, ONELOOK_MAX_UPLOAD_MB); send it later"
                raise HTTPException(503, detail, {"Retry-After": str(RETRY_S)})
            return message

        try:
            await self._app(scope, counted, send)
        finally:
            self._held -= size

    def _most(self, scope: Scope) -> int:
        return self._max_mb * MB if media_type(Headers(scope=scope)) in FILES else min(MAX_TEXT_BYTES, self._max_mb * MB)

    def _too_large(self, most: int) -> str:
        if most == self._max_mb * MB:
            return f"the body has more than {self._max_mb} MB (ONELOOK_MAX_UPLOAD_MB); send fewer or smaller images, colour as JPEG"
        return f"the body has more than {most // MB} MB, which only images and archives may; send fewer ids or shorter names"


def media_type(headers: Mapping[str, str]) -> str:
    """Of the body, without parameters."""
    return headers.get("content-type", "").partition(";")[0].strip().lower()
