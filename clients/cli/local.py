"""The service within this process: for one question, without a port, on the memory that `onelook serve` would open."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Coroutine, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import httpx

from clients.cli.terminal import errors
from clients.robot import RobotClient

T = TypeVar("T")


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

    def __init__(self, app: Any, loop: asyncio.AbstractEventLoop) -> None:
        self._transport = httpx.ASGITransport(app, raise_app_exceptions=False)
        self._loop = loop

    def handle_request(self, request: httpx.Request) -> httpx.Response:
        """One request and its whole answer."""
        return self.run(self._answer(request))

    def run(self, work: Coroutine[Any, Any, T]) -> T:
        """The result of `work` on that loop."""
        return asyncio.run_coroutine_threadsafe(work, self._loop).result()

    async def _answer(self, request: httpx.Request) -> httpx.Response:
        response = await self._transport.handle_async_request(request)
        return httpx.Response(response.status_code, headers=response.headers, content=await response.aread())


@contextmanager
def _service_here() -> Iterator[InProcess]:
    from clients.cli.service import read_settings
    from service.app import checked_backbone, create_app

    settings = read_settings({})
    with errors.status("loading the backbone"):
        app = create_app(settings, backbone=checked_backbone(settings))
    loop = asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_forever, daemon=True)
    thread.start()
    transport, lifespan = InProcess(app, loop), app.router.lifespan_context(app)
    try:
        transport.run(lifespan.__aenter__())
        try:
            yield transport
        finally:
            transport.run(lifespan.__aexit__(None, None, None))
    finally:
        loop.call_soon_threadsafe(loop.stop)
        thread.join()
        loop.close()
