"""/observations: what was seen."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse

from service.console.pages import Page, render
from service.deps import AgentDep
from store.records import Outcome

router = APIRouter(prefix="/observations", route_class=Page, include_in_schema=False)
PAGE = 24
"""Observations a page."""


@router.get("")
def observations(
    request: Request,
    agent: AgentDep,
    before: Annotated[str | None, Query()] = None,
    category_id: Annotated[str | None, Query()] = None,
    outcome: Annotated[Outcome | None, Query()] = None,
) -> HTMLResponse:
    """Newest first, a page at a time."""
    found = agent.memory.observations.latest(PAGE + 1, before=before, category_id=category_id, outcome=outcome)
    return render(
        request,
        "observations.html",
        observations=found[:PAGE],
        more=len(found) > PAGE,
        before=before,
        outcome=outcome,
        category_id=category_id,
        names=agent.names(),
    )


@router.get("/{observation_id}")
def observation(request: Request, observation_id: str, agent: AgentDep) -> HTMLResponse:
    """One of them, with everything that its answer rests on."""
    return render(request, "observation.html", observation=agent.memory.observations.get(observation_id), names=agent.names())


@router.get("/{observation_id}/card")
def observation_card(request: Request, observation_id: str, agent: AgentDep) -> HTMLResponse:
    """As it is in lists."""
    return render(request, "observation_card.html", observation=agent.memory.observations.get(observation_id), names=agent.names())
