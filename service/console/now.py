"""/: what happens in this moment."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

from service.console.pages import Page, render
from service.deps import AgentDep

router = APIRouter(route_class=Page, include_in_schema=False)
LATEST = 12
"""Observations shown."""


@router.get("/")
def now(request: Request, agent: AgentDep) -> HTMLResponse:
    """The latest observations and the scans in progress."""
    return render(request, "now.html", observations=agent.memory.observations.latest(LATEST), names=agent.names())
