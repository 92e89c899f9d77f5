"""What a browser may be made to do by the pages of others: nothing here."""

from __future__ import annotations

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.errors import problem_answer
from service.refusals import NotAllowed

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
OWN = frozenset({"same-origin", "none"})
"""What a browser says of requests that this service's own pages, or the person at the keyboard, made."""
HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
"""Of every answer: taken for what its media type says, shown in nobody's frame or page, and telling no other site its address."""


class OwnPagesOnly:
    """Refuses changes and WebSockets that another site's page makes a browser ask for, with whatever cookie it has."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One connection."""

        async def with_headers(message: Message) -> None:
            if message["type"] in {"http.response.start", "websocket.http.response.start"}:
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        changes = scope["type"] == "websocket" or (scope["type"] == "http" and scope["method"] not in SAFE_METHODS)
        if changes and _foreign(Headers(scope=scope)):
            refused = NotAllowed("this was sent by a page of another site; open the service's own address, and do it there")
            await problem_answer(refused)(scope, receive, with_headers)
        else:
            await self._app(scope, receive, with_headers)


def _foreign(headers: Headers) -> bool:
    """Robots send neither header; browsers send the first where the service is reached by HTTPS or on this machine, else the second."""
    site, origin = headers.get("sec-fetch-site"), headers.get("origin")
    if site is not None:
        return site not in OWN
    return origin is not None and origin.partition("://")[2] != headers.get("host")
