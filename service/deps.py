"""What routes ask for: the agent, the compute lane, and the burst in a request's body."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, TypeVar

import anyio
from anyio.to_thread import run_sync
from fastapi import Depends, Request
from starlette.datastructures import FormData, UploadFile
from starlette.exceptions import HTTPException
from starlette.formparsers import MultiPartException, MultiPartParser

from core.errors import InvalidInput
from service.agent import Agent
from service.decoding import Parts, Upload, decode_parts
from service.npz import decode_npz
from service.settings import Settings

IMAGE_PARTS = ("rgb", "depth", "mask")
PARTS = ("burst", *IMAGE_PARTS)
T = TypeVar("T")


class Lane:
    """Runs work that fills the machine, one piece at a time and off the event loop."""

    def __init__(self) -> None:
        self._limiter = anyio.CapacityLimiter(1)

    async def run(self, work: Callable[[], T]) -> T:
        """The result of `work()`."""
        return await run_sync(work, limiter=self._limiter)


def _agent(request: Request) -> Agent:
    agent: Agent = request.app.state.agent
    return agent


def _lane(request: Request) -> Lane:
    lane: Lane = request.app.state.lane
    return lane


def media_type(request: Request) -> str:
    """Of the body, without parameters."""
    return request.headers.get("content-type", "").partition(";")[0].strip().lower()


async def read_upload(request: Request) -> Upload:
    """The burst in the body, in either form. Raises InvalidInput, HTTPException 415."""
    settings: Settings = request.app.state.settings
    kind = media_type(request)
    if kind == "application/x-npz":
        body = await request.body()
        return await run_sync(lambda: decode_npz(body, settings.max_views))
    if kind == "multipart/form-data":
        parts = await _read_parts(request, settings)
        return await run_sync(lambda: decode_parts(parts, settings.max_views))
    found = f"is {kind}" if kind else "has no Content-Type"
    raise HTTPException(415, f"the body {found}; send multipart/form-data with the parts burst and rgb, or application/x-npz")


async def _read_parts(request: Request, settings: Settings) -> Parts:
    # Every part may be a file, the JSON one too; the counts are judged later, with a better message.
    parser = MultiPartParser(request.headers, request.stream(), max_files=2 * len(PARTS) * settings.max_views, max_fields=len(PARTS))
    try:
        form = await parser.parse()
    except MultiPartException as error:
        raise InvalidInput(
            "body", f"is not readable multipart/form-data ({error.message.rstrip('.')}); let the HTTP client write the boundary"
        ) from None
    try:
        unexpected = sorted(set(form) - set(PARTS))
        if unexpected:
            raise InvalidInput(unexpected[0], f"is not a part of a burst; the parts are {', '.join(PARTS)}")
        images = {name: [await _file(value, name) for value in form.getlist(name)] for name in IMAGE_PARTS}
        return Parts(await _burst_part(form), **images)
    finally:
        await form.close()


async def _file(value: UploadFile | str, name: str) -> bytes:
    if isinstance(value, str):
        raise InvalidInput(name, "is text; send it as a file (curl: -F rgb=@view.jpg)")
    return await value.read()


async def _burst_part(form: FormData) -> str | bytes:
    values = form.getlist("burst")
    if len(values) != 1:
        raise InvalidInput(
            "burst", f"is there {len(values)} times; send one JSON part burst with depth_scale and the views' K and world_from_camera"
        )
    value = values[0]
    return value if isinstance(value, str) else await value.read()


AgentDep = Annotated[Agent, Depends(_agent)]
LaneDep = Annotated[Lane, Depends(_lane)]
UploadDep = Annotated[Upload, Depends(read_upload)]
