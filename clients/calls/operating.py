"""The service itself and its memory."""

from __future__ import annotations

from clients.answers import Info
from clients.calls.call import Call, reading


def info() -> Call[Info]:
    """The service's version, backbone, threshold and the size of its memory."""
    return Call("GET", "/v1/info", reading(Info.from_json))
