"""/categories: what is known, and one category with everything that its recognition rests on."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import HTMLResponse, JSONResponse

from core.errors import Unavailable
from core.reference import Reference
from service.agent import Agent
from service.console.change import done
from service.console.facts import health, symmetry_words, variance_bars
from service.console.pages import Page, render
from service.console.scenes import reference_scene
from service.deps import AgentDep
from service.exchange import MemoryRoute
from service.gallery import CategoryGallery
from service.routes.png import Side, png
from store.overview import Order
from store.records import LONGEST_NAME

router = APIRouter(prefix="/categories", route_class=Page, include_in_schema=False)
PAGE = 48
"""Categories a page."""
NEAREST = 6
"""Other categories that one may be taken for."""
HISTORY = 12
"""Changes shown of one category."""


@router.get("")
def categories(
    request: Request,
    agent: AgentDep,
    page: Annotated[int, Query(ge=1, le=10_000)] = 1,
    order: Annotated[Order, Query()] = "name",
    called: Annotated[str, Query(max_length=LONGEST_NAME)] = "",
    change: Annotated[str | None, Query()] = None,
) -> HTMLResponse:
    """All of them, a page at a time."""
    found = agent.memory.categories.listing(PAGE, (page - 1) * PAGE, order=order, called=called.strip() or None)
    shown = [(each, health(each)) for each in found.categories]
    template = "category_grid.html" if request.headers.get("hx-target") == "grid" else "categories.html"
    pages = -(-found.total // PAGE)
    return render(
        request,
        template,
        shown=shown,
        total=found.total,
        page=page,
        pages=pages,
        order=order,
        called=called,
        done=done(agent, change),
    )


class PictureRoute(MemoryRoute):
    """A picture that pages show: kept by browsers as those of the service are."""

    kind = Page.kind


pictures = APIRouter(prefix="/categories", route_class=PictureRoute, include_in_schema=False)


@pictures.get("/{category_id}/cover.png")
def category_cover(category_id: str, agent: AgentDep, side: Side = None) -> Response:
    """The reference view whose object has a usual size in it: neither all background nor hardly seen."""
    sizes = [len(view.cells) for view in agent.memory.categories.reference(category_id).views]
    usual = int(np.abs(np.array(sizes) - np.median(sizes)).argmin())
    return png(CategoryGallery(agent, category_id).foreground(usual), side)


@router.get("/{category_id}")
def category(request: Request, category_id: str, agent: AgentDep, change: Annotated[str | None, Query()] = None) -> HTMLResponse:
    """One of them; of a damaged reference it says so, and shows the rest, so that the category can be deleted."""
    found = agent.memory.categories.get(category_id)
    summary = agent.memory.categories.summary(category_id)
    reference, damage = _reference(agent, category_id)
    return render(
        request,
        "category.html",
        category=found,
        summary=summary,
        health=health(summary),
        damage=damage,
        symmetries=symmetry_words(reference) if reference else [],
        variance=variance_bars(reference.basis.explained) if reference else [],
        instances=agent.memory.instances.of(category_id),
        goals=agent.memory.goals.of(category_id),
        entries=agent.memory.audit.of(category_id, HISTORY),
        names=agent.names(),
        done=done(agent, change),
    )


def _reference(agent: Agent, category_id: str) -> tuple[Reference | None, str | None]:
    """It, or what is wrong with it."""
    try:
        return agent.memory.categories.reference(category_id), None
    except Unavailable as error:
        return None, str(error)


@router.get("/{category_id}/scene")
def category_scene(category_id: str, agent: AgentDep) -> JSONResponse:
    """What the 3-D view shows of it."""
    categories = agent.memory.categories
    return JSONResponse(reference_scene(categories.reference(category_id), categories.burst(category_id)))


@router.get("/{category_id}/nearest")
def category_nearest(request: Request, category_id: str, agent: AgentDep) -> HTMLResponse:
    """What it is most likely to be taken for, and how alike its own bursts are: a part of its page, since it compares with everything."""
    return render(request, "category_nearest.html", category_id=category_id, **_nearest(agent, category_id))


def _nearest(agent: Agent, category_id: str) -> dict[str, Any]:
    similarities = agent.curation.similarities(category_id)
    within = similarities.matrix[~np.eye(len(similarities.matrix), dtype=bool)]
    least, most = (float(within.min()), float(within.max())) if len(within) else (None, None)
    nearest = similarities.categories[:NEAREST]
    return {"similarities": similarities, "nearest": nearest, "least_within": least, "most_within": most, "names": agent.names()}
