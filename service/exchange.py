"""What every exchange over HTTP has in common: unchanged reads are not sent again, repeated writes are not done again."""

from __future__ import annotations

import hashlib

from anyio.to_thread import run_sync
from fastapi import Request, Response

from core.errors import InvalidInput
from service.guarded import Answering, GuardedRoute
from service.state import running
from store.requests import Earlier, Reply

KEY = "Idempotency-Key"
LONGEST_KEY = 200
REPEATED = "Idempotency-Replayed"
"""Header of an answer that was given before."""
CLOCKED = {"list_scans", "get_scan", "list_observations", "get_observation", "list_changes"}
"""GETs whose answers time alone changes: a scan expires, a change can no longer be undone, and the memory's version says so late."""


class MemoryRoute(GuardedRoute):
    """A route that reads or changes the memory.

    A GET is answered with an ETag of the service's run and the memory's version, or of the answer itself where it is one of CLOCKED, and
    with 304 where the caller has that already. A POST with an Idempotency-Key is carried out once: its repetitions get the first answer
    again.
    """

    def around(self, answer: Answering) -> Answering:
        """That."""
        methods = self.methods or set()

        async def exchange(request: Request) -> Response:
            if "GET" in methods:
                return await (_compared if self.name in CLOCKED else _conditional)(request, answer)
            if "POST" in methods:
                return await _once(request, answer, self.path_format)
            return await answer(request)

        return exchange


async def _conditional(request: Request, answer: Answering) -> Response:
    app = running(request)
    version = await run_sync(lambda: app.agent.memory.version)  # before the answer is made, which may be newer than its tag, never older
    tag = f'W/"{app.run_id}-{version}"'  # a later run may be of another OneLook or a restored memory
    return _tagged(Response(status_code=304) if _has(request, tag) else await answer(request), tag)


async def _compared(request: Request, answer: Answering) -> Response:
    response = await answer(request)
    tag = f'W/"{hashlib.sha256(response.body).hexdigest()}"'
    return _tagged(Response(status_code=304) if _has(request, tag) else response, tag)


def _has(request: Request, tag: str) -> bool:
    known = {each.strip() for each in request.headers.get("if-none-match", "").split(",")}
    return bool(known & {tag, "*"})


def _tagged(response: Response, tag: str) -> Response:
    response.headers["ETag"] = tag
    response.headers["Cache-Control"] = "private, no-cache"  # to be kept, and asked for again with If-None-Match
    return response


async def _once(request: Request, answer: Answering, route: str) -> Response:
    key = request.headers.get(KEY)
    if key is None:
        return await answer(request)
    if not 1 <= len(key) <= LONGEST_KEY:
        raise InvalidInput(KEY, f"has {len(key)} characters; send 1 to {LONGEST_KEY}, such as a UUID made anew for each request")
    digest = _digest(request, await request.body())
    # Entered on the event loop: the key travels to the thread that changes the memory in the context of this task.
    with running(request).agent.memory.requests.once(key, route, digest) as once:
        if once.earlier is not None:
            return await run_sync(_again, request, once.earlier, route)
        response = await answer(request)
        if response.status_code < 300:
            once.reply = Reply(response.status_code, response.headers.get("content-type", ""), bytes(response.body))
        return response


def _digest(request: Request, body: bytes) -> str:
    """Of what is asked; the boundary of a multipart body is another one at each repetition, and says nothing."""
    kind, _, parameters = request.headers.get("content-type", "").partition(";")
    boundary = parameters.partition("boundary=")[2].strip().strip('"').encode()
    content = body.replace(boundary, b"") if boundary else body
    asked = f"{request.url.path}?{request.url.query}\n{kind}\n".encode()
    return hashlib.sha256(asked + content).hexdigest()


def _again(request: Request, earlier: Earlier, route: str) -> Response:
    """The first answer; where that was lost because the service ended just then, what the request made, as it is now."""
    reply = earlier.reply
    if reply is None:
        assert earlier.result_id is not None, "what changed nothing is not kept"
        app = running(request)
        made = app.made[route](app.agent, earlier.result_id, request.query_params)
        reply = Reply(200, "application/json", made.model_dump_json(by_alias=True).encode())
    return Response(reply.body, reply.status, {REPEATED: "true"}, reply.media_type)
