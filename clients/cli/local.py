"""The service within this process: for one question, without a port, on the memory that `onelook serve` would open."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import httpx

from clients.cli.terminal import errors
from clients.robot import RobotClient

if TYPE_CHECKING:
    from anyio.from_thread import BlockingPortal


@contextmanager
def connected(url: str, local: bool) -> Iterator[RobotClient]:
    """A client of the service at `url`, or of one in this process.

    Raises InvalidInput for wrong settings, Conflict where another process has the memory open, Unavailable without weights.
    """
    if not local:
        with RobotClient(url) as robot:
            yield robot
        return
    with _service_here() as transport, RobotClient(http=httpx.Client(transport=transport, base_url="http://onelook.local")) as robot:
        yield robot


class InProcess(httpx.BaseTransport):
    """Hands requests to an application that runs on another thread's event loop."""

    def __init__(self, app: Any, portal: BlockingPortal) -> None:
        self._transport = httpx.ASGITransport(app, raise_app_exceptions=False)
        self._portal = portal

    def handle_request(self, request: httpx.Request) -> httpx.Response:
        """One request and its whole answer."""
        return self._portal.call(self._answer, request)

    async def _answer(self, request: httpx.Request) -> httpx.Response:
        response = await self._transport.handle_async_request(request)
        return httpx.Response(response.status_code, headers=response.headers, content=await response.aread())


@contextmanager
def _service_here() -> Iterator[InProcess]:
    from anyio.from_thread import start_blocking_portal

    from clients.cli.service import read_settings
    from service.app import checked_backbone, create_app

    settings = read_settings({})
    with errors.status("loading the backbone"):
        app = create_app(settings, backbone=checked_backbone(settings), asks=False)
    with start_blocking_portal() as portal, portal.wrap_async_context_manager(app.router.lifespan_context(app)):
        yield InProcess(app, portal)
