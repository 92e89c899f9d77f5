"""What a person changes on a page, and takes back: each is a form, answered with the page it leads to and what was done."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from fastapi import APIRouter, Form, Query, Request
from fastapi.responses import HTMLResponse, RedirectResponse

from core.errors import NotFound
from service.agent import Agent
from service.console.pages import ConsoleActorDep, Page, query, render
from service.console.words import change_words
from service.deps import AgentDep, WorkDep
from store.records import LONGEST_NAME, AuditEntry

router = APIRouter(route_class=Page, include_in_schema=False)
Name = Annotated[str, Form(max_length=LONGEST_NAME)]


@dataclass(frozen=True)
class Done:
    """A change that was just made."""

    words: str
    entry: AuditEntry


def done(agent: Agent, entry_id: str | None) -> Done | None:
    """What a page says of the change that led to it."""
    if entry_id is None:
        return None
    try:
        entry = agent.memory.audit.get(entry_id)
    except NotFound:
        return None
    return Done(change_words(entry, agent.names()), entry)


def _after(agent: Agent, category_id: str, address: str | None = None) -> RedirectResponse:
    """To the category's page, or another one, which tells of the category's latest change."""
    entry = agent.memory.audit.of(category_id, 1)[0]
    return RedirectResponse((address or f"/categories/{category_id}") + query(change=entry.id), 303)


@router.post("/categories/{category_id}/rename")
def rename(category_id: str, agent: AgentDep, actor: ConsoleActorDep, name: Name = "") -> RedirectResponse:
    """An empty name takes it away."""
    agent.curation.rename(category_id, name.strip() or None, actor=actor)
    return _after(agent, category_id)


@router.get("/categories/{category_id}/merge")
def plan_merge(request: Request, category_id: str, agent: AgentDep, into: Annotated[str | None, Query()] = None) -> HTMLResponse:
    """Which category to merge it into, and what that changes."""
    category = agent.memory.categories.get(category_id)
    preview = agent.curation.preview_merge(category_id, into) if into else None
    similar = [] if preview else agent.curation.similarities(category_id).categories
    return render(request, "merge.html", category=category, preview=preview, similar=similar, names=agent.names())


@router.post("/categories/{category_id}/merge")
def merge(category_id: str, agent: AgentDep, actor: ConsoleActorDep, into: Annotated[str, Form()]) -> RedirectResponse:
    """Its bursts join the other one."""
    agent.curation.merge(category_id, into, actor=actor)
    return _after(agent, into)


@router.post("/categories/{category_id}/split")
async def split(
    category_id: str, agent: AgentDep, work: WorkDep, actor: ConsoleActorDep, instance: Annotated[list[str], Form()], name: Name = ""
) -> RedirectResponse:
    """Bursts leave for a category of their own."""
    made = await work.run(lambda: agent.curation.split(category_id, instance, name.strip() or None, actor=actor))
    return _after(agent, made.id)


@router.post("/categories/{category_id}/forget")
def forget(category_id: str, agent: AgentDep, actor: ConsoleActorDep, instance: Annotated[str, Form()]) -> RedirectResponse:
    """Takes a burst out of it."""
    agent.curation.forget_instance(category_id, instance, actor=actor)
    return _after(agent, category_id)


@router.get("/categories/{category_id}/delete")
def plan_deletion(request: Request, category_id: str, agent: AgentDep) -> HTMLResponse:
    """What would be gone."""
    summary = agent.memory.categories.summary(category_id)
    return render(request, "delete.html", category=summary, goals=len(agent.memory.goals.of(category_id)))


@router.post("/categories/{category_id}/delete")
def delete(category_id: str, agent: AgentDep, actor: ConsoleActorDep) -> RedirectResponse:
    """Forgets it."""
    agent.curation.delete(category_id, actor=actor)
    return _after(agent, category_id, "/categories")


@router.post("/changes/{entry_id}/undo")
def undo(entry_id: str, agent: AgentDep, actor: ConsoleActorDep) -> RedirectResponse:
    """Takes a change back, and shows what it was about."""
    undone = agent.upkeep.undo(entry_id, actor=actor)
    living = undone.category_id in agent.names()
    return RedirectResponse(f"/categories{f'/{undone.category_id}' if living else ''}{query(change=undone.id)}", 303)
