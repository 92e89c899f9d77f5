"""/memory: how much there is, how it decides and why there, copies of it, and every change with the way back."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, BackgroundTasks, Form, Query, Request, Response
from fastapi.responses import HTMLResponse, RedirectResponse

from core.calibration import LARGEST_RATE
from core.scores import BEST
from service.agent import Agent
from service.console.change import done
from service.console.pages import ConsoleActorDep, Page, query, render
from service.console.score_chart import ScoreChart, score_chart
from service.console.token_map import token_map
from service.deps import AgentDep, SettingsDep, WorkDep
from service.routes.memory import export_memory
from service.schemas.memory import ExportQuery, MemoryInfo
from service.settings import SMALLEST_RATE
from store.records import Errand

router = APIRouter(prefix="/memory", route_class=Page, include_in_schema=False)
CHANGES = 20
"""Changes a page."""


@router.get("")
def memory(
    request: Request,
    agent: AgentDep,
    settings: SettingsDep,
    change: Annotated[str | None, Query()] = None,
    before: Annotated[str | None, Query()] = None,
) -> HTMLResponse:
    """All of it; further changes alone where htmx asks for them."""
    changes = agent.memory.audit.latest(CHANGES + 1, before=before)
    listed: dict[str, Any] = {"changes": changes[:CHANGES], "more": len(changes) > CHANGES, "names": agent.names()}
    if before is not None and "hx-request" in request.headers:
        return render(request, "memory_changes.html", **listed)
    return render(
        request,
        "memory.html",
        **listed,
        info=MemoryInfo.of(agent),
        charts=_charts(agent),
        settings=settings,
        done=done(agent, change),
    )


def _charts(agent: Agent) -> list[tuple[bool, ScoreChart]]:
    """Whether poses were tried, and the evidence then; none where the threshold is not made of a rate."""
    if agent.config.score != BEST or agent.config.threshold is not None:
        return []
    tokens, verified = agent.upkeep.distributions()
    return [(True, score_chart(verified)), (False, score_chart(tokens))]


@router.get("/map")
def memory_map(request: Request, agent: AgentDep) -> HTMLResponse:
    """The memory's tokens in a plane: a part of its page, since it reads them all."""
    names = agent.names()
    return render(request, "memory_map.html", map=token_map(agent.memory.instances.members(), names), names=names)


@router.post("/calibrate")
def calibrate(
    agent: AgentDep,
    actor: ConsoleActorDep,
    percent: Annotated[float | None, Form(ge=100 * SMALLEST_RATE, le=100 * LARGEST_RATE)] = None,
) -> RedirectResponse:
    """Keeps a rate; an empty field goes back to the setting's."""
    agent.upkeep.calibrate(None if percent is None else percent / 100, actor=actor)
    return _after(agent, "calibrate")


@router.post("/backup")
async def backup(agent: AgentDep, work: WorkDep, settings: SettingsDep, actor: ConsoleActorDep) -> RedirectResponse:
    """Copies all of it beside the memory."""
    await work.run_endless(lambda: agent.upkeep.backup(settings.backups, actor=actor))
    return _after(agent, "backup")


@router.post("/export")
async def export(
    agent: AgentDep, work: WorkDep, after: BackgroundTasks, actor: ConsoleActorDep, category: Annotated[list[str] | None, Form()] = None
) -> Response:
    """The chosen categories as a file, all where none are."""
    return await export_memory(ExportQuery(category_id=category or []), agent, work, after, actor)


def _after(agent: Agent, errand: Errand) -> RedirectResponse:
    """To the page, which tells of the latest of this kind."""
    latest = next((each.id for each in agent.memory.audit.latest(CHANGES) if each.action == errand), None)
    return RedirectResponse("/memory" + query(change=latest), 303)
