"""Bounds what a request may send."""

from __future__ import annotations

from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send


class UploadLimit:
    """Stops a request whose body grows beyond `max_mb`, whatever its headers said."""

    def __init__(self, app: ASGIApp, max_mb: int) -> None:
        self._app = app
        self._max_mb = max_mb

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One connection."""
        size = 0

        async def counted() -> Message:
            nonlocal size
            message = await receive()
            size += len(message.get("body", b""))
            if size > self._max_mb * 1_000_000:
                detail = f"the body has more than {self._max_mb} MB (ONELOOK_MAX_UPLOAD_MB); send fewer or smaller images, colour as JPEG"
                # Raised within the route that reads the body, so it becomes a problem like every other error.
                raise HTTPException(413, detail)
            return message

        await self._app(scope, counted if scope["type"] == "http" else receive, send)
