"""The service itself and its memory."""

from __future__ import annotations

from collections.abc import Sequence

from clients.answers.memory import Backup, Import, Info, MemoryInfo, Thresholds
from clients.calls.call import Call, given, reading


def info() -> Call[Info]:
    """The service's version, backbone, threshold and the size of its memory."""
    return Call("GET", "/v1/info", reading(Info.from_json))


def memory() -> Call[MemoryInfo]:
    """What the memory holds, what it was made with, and how it decides."""
    return Call("GET", "/v1/memory", reading(MemoryInfo.from_json))


def calibrate(false_known_rate: float | None) -> Call[Thresholds]:
    """Keeps with the memory how many objects of no known category it may call known; None goes back to the service's setting."""
    return Call("POST", "/v1/memory/calibrate", reading(Thresholds.from_json), body={"json": {"false_known_rate": false_known_rate}})


def backup() -> Call[Backup]:
    """Copies the whole memory, while it is used, to a new folder on the service's machine."""
    return Call("POST", "/v1/memory/backup", reading(Backup.from_json))


def export_memory(category_ids: Sequence[str] = ()) -> Call[bytes]:
    """Categories, all of them or some, as one archive for another robot's memory."""
    return Call("POST", "/v1/memory/export", lambda response: response.content, given(category_id=list(category_ids) or None))


def import_memory(archive: bytes) -> Call[Import]:
    """Takes in the categories of another memory's export: all of them, or none where anything is wrong."""
    body = {"content": archive, "headers": {"Content-Type": "application/zip"}}
    return Call("POST", "/v1/memory/import", reading(Import.from_json), body=body)
