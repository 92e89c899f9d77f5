"""What routes ask for: the agent, the work queue, who asks, and the burst in a request's body."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, TypeVar

from fastapi import Depends, Header, Request
from fastapi.exceptions import RequestValidationError
from pydantic import ValidationError
from starlette.datastructures import FormData, UploadFile
from starlette.exceptions import HTTPException
from starlette.formparsers import MultiPartException, MultiPartParser

from core.errors import InvalidInput
from service.agent import Agent
from service.auth import LONGEST_ACTOR, Caller
from service.console.demo import Demo
from service.decoding import BurstLimits, Parts, Upload, decode_parts
from service.goals import Source
from service.limits import media_type
from service.metrics import Metrics
from service.npz import decode_npz
from service.schemas.bursts import Seen
from service.settings import Settings
from service.state import running
from service.work import WorkQueue

IMAGE_PARTS = ("rgb", "depth", "mask")
PARTS = ("burst", *IMAGE_PARTS)
T = TypeVar("T")
Decode = Callable[[], Upload]
"""Decodes a body that has arrived: images are many times larger than their files, so only what is worked on is decoded."""


@dataclass(frozen=True)
class RequestWork:
    """The work that one request asks for."""

    queue: WorkQueue
    request: Request

    async def run(self, work: Callable[[], T]) -> T:
        """See `WorkQueue.run`: until the deadline, and while whoever asks is there."""
        return await self.queue.run(work, gone=self._gone)

    async def run_endless(self, work: Callable[[], T]) -> T:
        """As long as it takes, also for nobody."""
        return await self.queue.run(work, endless=True)

    async def _gone(self) -> None:
        """Returns once the connection has ended; the body was read before."""
        while (await self.request.receive())["type"] != "http.disconnect":
            pass


def _agent(request: Request) -> Agent:
    return running(request).agent


def _settings(request: Request) -> Settings:
    return running(request).settings


def _metrics(request: Request) -> Metrics:
    return running(request).metrics


def _demo(request: Request) -> Demo:
    return running(request).demo


def _work(request: Request) -> RequestWork:
    return RequestWork(running(request).work, request)


def _caller(request: Request) -> Caller:
    """Whom the guard let in."""
    caller: Caller = request.state.caller
    return caller


def _actor(
    request: Request,
    said: Annotated[
        str | None,
        Header(
            alias="X-Actor",
            min_length=1,
            max_length=LONGEST_ACTOR,
            description="Who asks; kept in the audit trail, after the name of their key where there is one. Never checked.",
        ),
    ] = None,
) -> str | None:
    return _caller(request).as_actor(said)


async def read_upload(request: Request) -> Decode:
    """The burst in the body, in either form, to be decoded where work is done. Raises InvalidInput, HTTPException 415."""
    settings = running(request).settings
    limits = BurstLimits(settings.max_views, settings.max_megapixels)
    kind = media_type(request.headers)
    if kind == "application/x-npz":
        body = await request.body()
        return lambda: decode_npz(body, limits)
    if kind == "multipart/form-data":
        parts = await _read_parts(request, settings)
        return lambda: decode_parts(parts, limits)
    found = f"is {kind}" if kind else "has no Content-Type"
    raise HTTPException(415, f"the body {found}; send multipart/form-data with the parts burst and rgb, or application/x-npz")


@dataclass(frozen=True)
class Sent:
    """What a request is about."""

    source: Source
    frame: str | None
    """Of the burst."""


async def _read_sent(request: Request) -> Callable[[], Sent]:
    """A burst in either form, to be decoded where work is done, or JSON that names an observation."""
    if media_type(request.headers) != "application/json":
        decode = await read_upload(request)
        return lambda: _sent(decode())
    try:
        seen = Seen.model_validate_json(await request.body())
    except ValidationError as error:
        raise RequestValidationError(error.errors()) from None
    return lambda: Sent(seen.observation_id, None)


def _sent(upload: Upload) -> Sent:
    return Sent(upload.burst, upload.frame)


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
SettingsDep = Annotated[Settings, Depends(_settings)]
MetricsDep = Annotated[Metrics, Depends(_metrics)]
DemoDep = Annotated[Demo, Depends(_demo)]
CallerDep = Annotated[Caller, Depends(_caller)]
WorkDep = Annotated[RequestWork, Depends(_work)]
ActorDep = Annotated[str | None, Depends(_actor)]
UploadDep = Annotated[Decode, Depends(read_upload)]
SentDep = Annotated[Callable[[], Sent], Depends(_read_sent)]
