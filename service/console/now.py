"""/: what happens in this moment."""

from __future__ import annotations

from dataclasses import dataclass
from typing import get_args

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

from service.agent import Agent
from service.console.hemisphere import Hemisphere, hemisphere_of
from service.console.observations import learnt_from
from service.console.pages import Page, render
from service.deps import AgentDep
from service.events import Kind
from store.records import Scan

router = APIRouter(route_class=Page, include_in_schema=False)
LATEST = 12
"""Observations shown."""
SCANS = 3
"""Scans in progress shown."""
CHANGES = 8
"""Changes of the memory shown."""


@dataclass(frozen=True, eq=False)
class ScanShown:
    """A scan in progress."""

    scan: Scan
    hemisphere: Hemisphere
    faulty: int
    """Views that something is wrong with."""


@router.get("/")
def now(request: Request, agent: AgentDep) -> HTMLResponse:
    """The latest observations, the scans in progress, and what changed."""
    heard = agent.events.last_id  # before anything is read: what happens meanwhile is told once more, never missed
    observations = agent.memory.observations.latest(LATEST)
    return render(
        request,
        "now.html",
        heard=heard,
        most=LATEST,
        kinds=sorted(set(get_args(Kind)) - {"observation", "dropped"}),
        observations=observations,
        learnt=learnt_from(agent, observations),
        scans=_scans(agent),
        changes=agent.memory.audit.latest(CHANGES),
        names=agent.names(),
    )


@router.get("/now/side")
def now_side(request: Request, agent: AgentDep) -> HTMLResponse:
    """What is beside the observations, again."""
    return render(request, "now_side.html", scans=_scans(agent), changes=agent.memory.audit.latest(CHANGES), names=agent.names())


def _scans(agent: Agent) -> list[ScanShown]:
    shown = []
    for scan in agent.memory.scans.in_progress(SCANS):
        progress = agent.scanning.progress(scan)
        shown.append(ScanShown(scan, hemisphere_of(scan.request, progress.coverage), sum(map(bool, progress.faults))))
    return shown
