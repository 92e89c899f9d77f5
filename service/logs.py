"""The log: a line for each request and for each thing that happened, and whose request it was."""

from __future__ import annotations

import json
import logging
import re
import time
import uuid
from collections.abc import Mapping
from contextvars import ContextVar
from datetime import datetime, timezone
from typing import Any, Literal

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.events import Event

Form = Literal["text", "json"]
HEADER = "X-Request-Id"
GIVEN_ID = re.compile(r"[\w.:-]{1,64}", re.ASCII)
"""An id that is taken over from the caller; any other one is replaced."""
PROBES = frozenset({"/healthz", "/readyz", "/metrics"})
"""Asked every few seconds, they get a line only where they fail."""

request_id: ContextVar[str | None] = ContextVar("request_id", default=None)
"""Of the request that the present work is for; threads inherit it."""
robot: ContextVar[str | None] = ContextVar("robot", default=None)
"""Who asked: the key's name, and what the caller says of itself."""

log = logging.getLogger("onelook")


class Logged:
    """Gives every request an id, tells it in the answer, and writes a line once the request is answered."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One connection."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        # Never reset: the task ends with the request, and what is logged of a failure after this still belongs to it.
        request_id.set(_id_of(scope))
        start, status = time.perf_counter(), 500

        async def noted(message: Message) -> None:
            nonlocal status
            if message["type"] in ("http.response.start", "websocket.http.response.start"):
                status = message["status"]
                MutableHeaders(scope=message)[HEADER] = request_id.get() or ""
            elif message["type"] == "websocket.accept":
                status = 101
            elif message["type"] == "websocket.close" and status == 500:
                status = 403
            await send(message)

        try:
            await self._app(scope, receive, noted)
        finally:
            if scope["path"] not in PROBES or status >= 400:
                client = scope.get("client")
                about = {"method": scope.get("method", "WEBSOCKET"), "path": scope["path"], "status": status}
                about |= {"seconds": round(time.perf_counter() - start, 4), "client": client[0] if client else None}
                log.info("request", extra={"about": about})


def _id_of(scope: Scope) -> str:
    given = Headers(scope=scope).get(HEADER, "")
    return given if GIVEN_ID.fullmatch(given) else uuid.uuid4().hex


def log_event(event: Event) -> None:
    """A line for one thing that happened."""
    log.info(event.kind, extra={"about": event.about})


def config(form: Form) -> dict[str, Any]:
    """For `logging.config.dictConfig`: everything on standard error, uvicorn's messages in the same form as the service's own."""
    logger = {"handlers": ["stderr"], "level": "INFO", "propagate": False}
    return {
        "version": 1,
        "disable_existing_loggers": False,
        "formatters": {"lines": {"()": JsonLines if form == "json" else TextLines}},
        "handlers": {"stderr": {"class": "logging.StreamHandler", "stream": "ext://sys.stderr", "formatter": "lines"}},
        "loggers": dict.fromkeys(("onelook", "uvicorn"), logger),
    }


class JsonLines(logging.Formatter):
    """One JSON object a line."""

    def format(self, record: logging.LogRecord) -> str:
        """The line."""
        facts = {"time": _time_of(record), "level": record.levelname, "logger": record.name, "message": record.getMessage()}
        facts |= _about(record)
        if record.exc_info:
            facts["exception"] = self.formatException(record.exc_info)
        return json.dumps(facts, default=str)


class TextLines(logging.Formatter):
    """Time, level, message, and `name=value`; only an exception takes more than one line."""

    def format(self, record: logging.LogRecord) -> str:
        """The line."""
        named = [f"{name}={_as_word(value)}" for name, value in _about(record).items()]
        line = " ".join([_time_of(record), record.levelname, record.getMessage(), *named])
        return f"{line}\n{self.formatException(record.exc_info)}" if record.exc_info else line


def _about(record: logging.LogRecord) -> dict[str, Any]:
    about: Mapping[str, Any] = getattr(record, "about", {})
    facts = {**about, "request_id": request_id.get(), "robot": robot.get()}
    return {name: value for name, value in facts.items() if value is not None}


def _as_word(value: object) -> str:
    """As it is where it is plain; else as JSON, so that nobody can end a line or add a name to it."""
    text = str(value)
    return text if re.fullmatch(r"[\w./:@+-]+", text, re.ASCII) else json.dumps(value, default=str)


def _time_of(record: logging.LogRecord) -> str:
    return datetime.fromtimestamp(record.created, timezone.utc).isoformat(timespec="milliseconds").replace("+00:00", "Z")
