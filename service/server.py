"""The server around the application, and how it ends: as it is told to, or by itself where something in it hangs for ever."""

from __future__ import annotations

import asyncio
import logging
import os
import socket
import threading
import time

import uvicorn
from fastapi import FastAPI

from service.state import Running

GRACE_S = 10
"""For answers to go out, once what was worked on is finished."""
POLL_S = 0.05
WATCH_S = 0.2
HUNG = os.EX_SOFTWARE
"""Exit code of a process that ended itself: whoever supervises it starts it anew."""
WRITE_DEADLINES = 10
"""A disk may be slow, and what it writes is answered as done; after so many deadlines it hangs."""
log = logging.getLogger("onelook")


class Server(uvicorn.Server):
    """Told to stop, it finishes what is worked on and sends away what waits; a second Ctrl+C ends it at once.

    Where it cannot go on, since what it needs does not come back, it ends its process: no thread can be stopped from outside, and what was
    answered is on the disk.
    """

    def __init__(self, app: FastAPI) -> None:
        super().__init__(uvicorn.Config(app, log_config=None, access_log=False, timeout_graceful_shutdown=GRACE_S))
        self._app = app
        self._still_s = 0.0
        """Since the event loop turned last, as the watch counts it: a process that was suspended did not hang."""

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Uvicorn's, and the watch: a thread, since the event loop may be what hangs."""
        await super().startup(sockets)
        threading.Thread(target=self._watch, name="watch", daemon=True).start()

    async def on_tick(self, counter: int) -> bool:
        """Uvicorn's, ten times a second."""
        self._still_s = 0.0
        return await super().on_tick(counter)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Uvicorn's, which cancels what takes longer than the grace; so work comes first."""
        running: Running = self._app.state.running
        running.work.stop()
        running.agent.events.close()
        while running.work.running and not self.force_exit:
            await asyncio.sleep(POLL_S)
        await super().shutdown(sockets)

    def hanging(self) -> str | None:
        """What has taken a second deadline after its own, or ten where it may be the disk that is slow.

        A pass that hangs is waited for while something else writes: that will be answered.
        """
        running: Running = self._app.state.running
        watched = (
            ("a pass of the backbone has run", 0.0 if running.work.writing else running.agent.backbone.pass_s(), 2),
            ("all workers have been held by requests that were given up", running.work.stuck_s() or 0.0, 1),
            ("a write has gone on after its deadline", running.work.late_write_s(), WRITE_DEADLINES),
            ("the event loop has stood still", self._still_s, WRITE_DEADLINES),
        )
        deadline_s = running.settings.deadline_s
        return next((f"{what} for {seconds:.0f} s" for what, seconds, times in watched if seconds > times * deadline_s), None)

    def _watch(self) -> None:
        while not self.should_exit:
            time.sleep(WATCH_S)
            self._still_s += WATCH_S
            hanging = self.hanging()
            if hanging is not None and not self.should_exit:
                log.error("%s and does not come back: the process ends with code %d, to be started anew", hanging, HUNG)
                os._exit(HUNG)  # waits for no thread; each line of the log is flushed as it is written
