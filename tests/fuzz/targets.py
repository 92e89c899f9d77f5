"""What is fuzzed: everything that reads bytes somebody else wrote. Each may refuse them in its own words, and do nothing else."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace

import numpy as np
from fastapi import FastAPI, Request
from pydantic import ValidationError
from starlette.exceptions import HTTPException

from core.errors import Conflict, InvalidInput
from service.decoding import BurstLimits, Parts, decode_parts
from service.deps import read_upload
from service.images import decode_colour, decode_depth, decode_mask
from service.npz import decode_npz
from service.schemas.tracking import FrameMessage, Hello
from service.settings import Settings
from store import untrusted
from store.memory import Memory

CORPUS = Path(__file__).parents[1] / "data" / "hostile"
LIMITS = BurstLimits(4, 1)
REFUSALS = (InvalidInput, Conflict, ValidationError, HTTPException)
BOUNDARY = b"xx"


def colour(content: bytes) -> None:
    """An uploaded colour image."""
    decode_colour(content, "rgb", upright=bool(len(content) % 2))


def depth(content: bytes) -> None:
    """An uploaded depth image."""
    decode_depth(content, "depth")


def mask(content: bytes) -> None:
    """An uploaded silhouette."""
    decode_mask(content, "mask")


def burst(content: bytes) -> None:
    """The JSON part of a burst, with an image that is in order."""
    image = (CORPUS / "colour-rgb.png").read_bytes()
    decode_parts(Parts(content, [image] * 2, [], []), LIMITS)


def npz(content: bytes) -> None:
    """A burst as one npz file."""
    decode_npz(content, LIMITS)


def frame(content: bytes) -> None:
    """A message of WS /v1/track."""
    text = content.decode(errors="surrogateescape")
    FrameMessage.model_validate_json(text).decode(0.0)


def hello(content: bytes) -> None:
    """The first message there."""
    Hello.model_validate_json(content.decode(errors="replace")).options()


def multipart(content: bytes) -> None:
    """A whole body; its boundary is `xx`."""
    app = FastAPI()
    app.state.running = SimpleNamespace(settings=Settings(max_views=4))
    scope = {
        "type": "http",
        "method": "POST",
        "path": "/",
        "query_string": b"",
        "headers": [(b"content-type", b"multipart/form-data; boundary=" + BOUNDARY)],
        "app": app,
    }

    async def body() -> dict[str, object]:
        return {"type": "http.request", "body": content, "more_body": False}

    asyncio.run(read_upload(Request(scope, body)))()


def arrays(content: bytes) -> None:
    """The arrays within an archive."""
    untrusted.arrays(content, "x.npz")


def archive(content: bytes) -> None:
    """An archive of categories, for a memory that has none."""
    memory, file = _memory()
    file.write_bytes(content)
    before = memory.version
    try:
        brought = memory.import_archive(file)
    except REFUSALS:
        assert memory.version == before, "a refused archive has changed the memory"
        raise
    for each in brought.categories:
        memory.categories.delete(each.id)


@cache
def _memory() -> tuple[Memory, Path]:
    """One memory, and a file beside it; both go with the process."""
    folder = TemporaryDirectory(prefix="onelook-fuzz-")
    memory = Memory.open(Path(folder.name) / "memory")
    memory.__dict__["kept"] = folder
    return memory, Path(folder.name) / "archive.zip"


TARGETS: dict[str, Callable[[bytes], None]] = {
    each.__name__: each for each in (colour, depth, mask, burst, npz, frame, hello, multipart, arrays, archive)
}
"""By name, which is the beginning of the names of their seeds in CORPUS."""


def seeds(name: str) -> list[bytes]:
    """What a target takes, and its fuzzing begins with."""
    return [path.read_bytes() for path in sorted(CORPUS.glob(f"{name}-*"))]


def attempt(name: str, content: bytes) -> bool:
    """Whether the target took it; refusals are in order, whatever else is raised is a finding."""
    try:
        with np.errstate(divide="raise", over="raise", invalid="raise"):
            TARGETS[name](content)
    except REFUSALS:
        return False
    return True
