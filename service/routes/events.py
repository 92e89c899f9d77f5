"""GET /v1/events: what happens, as it happens."""

from __future__ import annotations

import re
from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import APIRouter, Header, Query
from fastapi.sse import EventSourceResponse, ServerSentEvent

from service.deps import AgentDep
from service.guarded import GuardedRoute
from service.schemas.problem import problems

router = APIRouter(tags=["memory"], route_class=GuardedRoute)
GIVEN_ID = re.compile(r"\d{1,18}", re.ASCII)
"""An id that the service may have given; any other one says nothing."""


@router.get("/v1/events", response_class=EventSourceResponse, responses=problems(422))
async def events(
    agent: AgentDep,
    after: Annotated[int | None, Query(ge=0, description="First what happened after the event with this id.")] = None,
    last_event_id: Annotated[str | None, Header(description="The same, as browsers say it when they connect again.")] = None,
) -> AsyncIterator[ServerSentEvent]:
    """What happens, as server-sent events: observations, scans, changes of categories. `dropped` says how many were left out."""
    since = int(last_event_id) if last_event_id is not None and GIVEN_ID.fullmatch(last_event_id) else after
    async for event in agent.events.listen(since):
        yield ServerSentEvent(event=event.kind, id=str(event.id), data={"created_at": event.created_at, **event.about})
