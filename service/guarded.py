"""Routes that let nobody in but whom they may: the guard comes before anything else of a request."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Iterable
from typing import Any

from fastapi import APIRouter, FastAPI, Request, Response, WebSocket
from fastapi.routing import APIRoute

from service.access import needed_role
from service.state import running

Answering = Callable[[Request], Coroutine[Any, Any, Response]]


class GuardedRoute(APIRoute):
    """A route whose caller must have the role that `service.access` says."""

    kind = ""
    """Before the route's name in that table."""

    def get_route_handler(self) -> Answering:
        """FastAPI's, with `around` about it, and the guard before both."""
        answer = self.around(super().get_route_handler())
        needed = needed_role(self.kind + self.name)

        async def guarded(request: Request) -> Response:
            await running(request).guard.admit(request, needed)
            return await answer(request)

        return guarded

    def around(self, answer: Answering) -> Answering:
        """What else a kind of routes does; here nothing."""
        return answer


def include(app: FastAPI, routers: Iterable[APIRouter]) -> None:
    """Puts routes into the application. Raises LookupError for one that would let everybody in."""
    for router in routers:
        for route in router.routes:
            if isinstance(route, APIRoute) and not isinstance(route, GuardedRoute):
                raise LookupError(f"the route {route.name!r} asks nobody who they are: its APIRouter takes a GuardedRoute as route_class")
        app.include_router(router)


def admit_socket(name: str) -> Callable[[WebSocket], Coroutine[Any, Any, None]]:
    """A dependency that does the same for the WebSocket route of this name, before the connection is accepted."""
    needed = needed_role(name)

    async def admit(socket: WebSocket) -> None:
        await running(socket).guard.admit(socket, needed)

    return admit
