"""The server around the application: how it starts to listen, and how it ends."""

from __future__ import annotations

import socket

import uvicorn
from fastapi import FastAPI

GRACE_S = 30
"""For answers under way, once it shall stop: about the longest that one takes on a small machine."""


class Server(uvicorn.Server):
    """Told to stop, it finishes what is worked on; what waits is sent away, and listeners are not waited for."""

    def __init__(self, app: FastAPI) -> None:
        super().__init__(uvicorn.Config(app, log_config=None, access_log=False, timeout_graceful_shutdown=GRACE_S))
        self._app = app

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Uvicorn's, after the application was told."""
        self._app.state.work.stop()
        self._app.state.agent.events.close()
        await super().shutdown(sockets)
