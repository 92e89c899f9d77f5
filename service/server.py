"""The server around the application, and how it ends."""

from __future__ import annotations

import asyncio
import socket

import uvicorn
from fastapi import FastAPI

GRACE_S = 10
"""For answers to go out, once what was worked on is finished."""
POLL_S = 0.05


class Server(uvicorn.Server):
    """Told to stop, it finishes what is worked on and sends away what waits; a second Ctrl+C ends it at once."""

    def __init__(self, app: FastAPI) -> None:
        super().__init__(uvicorn.Config(app, log_config=None, access_log=False, timeout_graceful_shutdown=GRACE_S))
        self._app = app

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Uvicorn's, which cancels what takes longer than the grace; so work comes first."""
        state = self._app.state
        state.work.stop()
        state.agent.events.close()
        while state.work.running and not self.force_exit:
            await asyncio.sleep(POLL_S)
        await super().shutdown(sockets)
