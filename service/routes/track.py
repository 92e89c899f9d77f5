"""WS /v1/track: frames in, a pose for each frame out."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass, field

import anyio
from anyio.to_thread import run_sync
from fastapi import APIRouter, Depends, WebSocket, WebSocketDisconnect, status
from pydantic import BaseModel, ValidationError
from starlette.websockets import WebSocketState

from core.errors import OneLookError, Unavailable
from core.warm import WarmConfig
from service.agent import Agent
from service.errors import problem_of, validation_problem
from service.guarded import admit_socket
from service.refusals import Busy, TooLate
from service.schemas.tracking import Announcement, Dropped, FrameAnswer, FrameMessage, Hello, Ready, TrackProblem
from service.state import running
from service.tracker import Tracker
from service.work import WorkQueue

router = APIRouter()
WAITING_FRAMES = 2
"""More would only make answers late; what is dropped is told."""


@dataclass
class Waiting:
    """Messages that wait to be worked on, the latest few."""

    messages: deque[tuple[FrameMessage, float]] = field(default_factory=deque)
    """With the time of their arrival."""
    dropped: Dropped | None = None
    """What was dropped and not told yet."""
    arrived: anyio.Event = field(default_factory=anyio.Event)
    closed: bool = False

    def put(self, message: FrameMessage, arrived_s: float) -> None:
        """Drops the oldest where there are too many."""
        if len(self.messages) >= WAITING_FRAMES:
            self.drop(self.messages.popleft()[0].id)
        self.messages.append((message, arrived_s))
        self.arrived.set()

    def drop(self, frame_id: int) -> None:
        """Counts a frame that is not worked on."""
        before = self.dropped or Dropped(frames=0, first_id=frame_id, last_id=frame_id)
        self.dropped = Dropped(  # one that was taken and then refused is older than those that were dropped meanwhile
            frames=before.frames + 1, first_id=min(before.first_id, frame_id), last_id=max(before.last_id, frame_id)
        )

    async def take(self) -> tuple[FrameMessage, float] | None:
        """The oldest that waits, as soon as there is one; None at the end."""
        while not self.messages:
            if self.closed:
                return None
            await self.arrived.wait()
            self.arrived = anyio.Event()
        return self.messages.popleft()

    def close(self) -> None:
        """No more will come."""
        self.closed = True
        self.arrived.set()


@router.websocket("/v1/track", dependencies=[Depends(admit_socket("track"))])
async def track(socket: WebSocket) -> None:
    """Follows one object through frames; docs/http.md tells the messages."""
    await socket.accept()
    app = running(socket)
    if len(app.tracks) >= app.settings.max_tracks:
        error = Unavailable(f"{len(app.tracks)} objects are followed already (ONELOOK_MAX_TRACKS); end one, or try again later")
        await _refuse(socket, error, status.WS_1013_TRY_AGAIN_LATER)
        return
    app.tracks.add(socket)
    try:
        tracker = await _greet(socket, app.agent, app.warm, app.settings.deadline_s)
        if tracker is not None:
            await _follow(socket, tracker, app.agent, app.work)
    except WebSocketDisconnect:
        pass
    finally:
        app.tracks.discard(socket)


async def _greet(socket: WebSocket, agent: Agent, warm: WarmConfig, deadline_s: float) -> Tracker | None:
    """The tracker that `hello` asks for; None where it is refused."""
    try:
        hello = await _hello(socket, deadline_s)
        tracker = await run_sync(lambda: Tracker(agent, hello.options(), warm))
    except (ValidationError, OneLookError) as error:
        await _refuse(socket, error, status.WS_1008_POLICY_VIOLATION)
        return None
    await _send(socket, Ready(category_id=tracker.category_id, window=hello.window, weight=hello.weight))
    return tracker


async def _hello(socket: WebSocket, deadline_s: float) -> Hello:
    """The first message. Raises WebSocketDisconnect, ValidationError, TooLate."""
    try:
        with anyio.fail_after(deadline_s):
            return Hello.model_validate_json(await _text(socket))
    except TimeoutError:
        raise TooLate(f"no `hello` came within {deadline_s:g} s (ONELOOK_DEADLINE_S); connect again and send it first") from None


async def _follow(socket: WebSocket, tracker: Tracker, agent: Agent, work: WorkQueue) -> None:
    waiting = Waiting()
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(_answer_frames, socket, tracker, agent, work, waiting)
        try:
            while True:
                await _receive(socket, waiting)
        except WebSocketDisconnect:
            waiting.messages.clear()
            waiting.close()


async def _receive(socket: WebSocket, waiting: Waiting) -> None:
    text = await _text(socket)
    try:
        waiting.put(FrameMessage.model_validate_json(text), time.monotonic())
    except ValidationError as error:
        await _send(socket, TrackProblem(frame_id=None, problem=validation_problem(error.errors())))


async def _answer_frames(socket: WebSocket, tracker: Tracker, agent: Agent, work: WorkQueue, waiting: Waiting) -> None:
    try:
        while (taken := await waiting.take()) is not None:
            message, arrived_s = taken
            if waiting.dropped is not None:
                told, waiting.dropped = waiting.dropped, None
                await _send(socket, told)
            try:
                update = await work.run(lambda message=message, at=arrived_s: tracker.step(message.decode(at)))  # type: ignore[misc]
            except Busy:
                waiting.drop(message.id)
                continue
            except OneLookError as error:
                await _send(socket, TrackProblem(frame_id=message.id, problem=problem_of(error)))
                continue
            for kind, happened in (("found", update.found), ("lost", update.lost)):
                if happened:
                    await _send(socket, Announcement(type=kind, frame_id=update.frame_id))
            names = await run_sync(agent.names) if update.decision else {}
            await _send(socket, FrameAnswer.of(update, tracker.category_id, names, (time.monotonic() - arrived_s) * 1e3))
    except WebSocketDisconnect:  # it went away while it was being answered
        waiting.close()


async def _text(socket: WebSocket) -> str:
    """The next message. Raises WebSocketDisconnect."""
    message = await socket.receive()
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(message.get("code", status.WS_1000_NORMAL_CLOSURE))
    return str(message.get("text") or "")


async def _send(socket: WebSocket, message: BaseModel) -> None:
    """Waits while the other side does not take it: meanwhile frames are dropped, not queued. Raises WebSocketDisconnect."""
    if socket.application_state != WebSocketState.CONNECTED or socket.client_state != WebSocketState.CONNECTED:
        raise WebSocketDisconnect
    await socket.send_text(message.model_dump_json())


async def _refuse(socket: WebSocket, error: ValidationError | OneLookError, code: int) -> None:
    problem = validation_problem(error.errors()) if isinstance(error, ValidationError) else problem_of(error)
    await _send(socket, TrackProblem(frame_id=None, problem=problem))
    await socket.close(code)
