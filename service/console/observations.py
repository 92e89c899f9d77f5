"""/observations: what was seen, and why it was answered so."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Form, Query, Request, Response
from fastapi.responses import HTMLResponse, JSONResponse

from core.errors import NotFound, Unavailable
from core.novelty import Outcome
from service.agent import Agent
from service.console.alignment import aligned_scene
from service.console.change import Name
from service.console.evidence import Hypothesis, Matrix, Stage
from service.console.pages import ConsoleActorDep, Page, render
from service.console.words import called
from service.deps import AgentDep, CallerDep, WorkDep
from service.features import pose_details_from_arrays
from store.records import Observation

router = APIRouter(prefix="/observations", route_class=Page, include_in_schema=False)
PAGE = 24
"""Observations a page."""
Picture = Literal["overlay", "rgb", "foreground", "pca"]


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
        learnt=learnt_from(agent, found),
    )


@router.get("/{observation_id}")
def observation(request: Request, observation_id: str, agent: AgentDep, caller: CallerDep, show: Picture | None = None) -> HTMLResponse:
    """One of them, with everything that its answer rests on."""
    seen = agent.memory.observations.get(observation_id)
    names = agent.names()
    return render(
        request,
        "observation.html",
        observation=seen,
        names=names,
        choices=sorted(
            ((category_id, called(name, category_id)) for category_id, name in names.items()), key=lambda each: each[1].casefold()
        ),
        show=show or ("overlay" if seen.pose else "rgb"),
        scan=agent.memory.scans.get(seen.scan_id) if seen.scan_id else None,
        hypotheses=Hypothesis.all_of(seen.pose) if seen.pose else [],
        stages=Stage.all_of(seen.timings_ms),
        may_correct=caller.may_call("correct_observation"),
        **_evidence(agent, seen),
    )


@router.get("/{observation_id}/card")
def observation_card(request: Request, observation_id: str, agent: AgentDep) -> HTMLResponse:
    """As it is in lists."""
    seen = agent.memory.observations.get(observation_id)
    return render(request, "observation_card.html", observation=seen, names=agent.names(), learnt=learnt_from(agent, [seen]))


@router.get("/{observation_id}/views")
def observation_views(request: Request, observation_id: str, agent: AgentDep, show: Picture = "rgb") -> HTMLResponse:
    """Its views, drawn in one of several ways."""
    return render(request, "observation_views.html", observation=agent.memory.observations.get(observation_id), show=show)


@router.get("/{observation_id}/correspondences")
def observation_matches(request: Request, observation_id: str, agent: AgentDep, view: Annotated[int, Query(ge=0)]) -> HTMLResponse:
    """Of one of its views."""
    seen = agent.memory.observations.get(observation_id)
    evidence = _evidence(agent, seen)
    if evidence["matrix"] is None:
        raise NotFound(f"observation {observation_id!r} has no correspondences to show")
    return render(request, "observation_matches.html", observation=seen, **(evidence | {"view": view}))


@router.get("/{observation_id}/scene.json")
def observation_scene(observation_id: str, agent: AgentDep) -> JSONResponse:
    """What the viewer draws of its pose."""
    seen = agent.memory.observations.get(observation_id)
    if seen.pose is None or seen.category_id is None:
        raise NotFound(f"observation {observation_id!r} has nothing to align: it has no pose, or its category was deleted")
    reference = agent.memory.categories.reference(seen.category_id)
    size = agent.memory.observations.view(observation_id, 0).size
    return JSONResponse(aligned_scene(seen.pose, reference, agent.encoded(observation_id), size))


@router.post("/{observation_id}/correct")
async def observation_correct(
    observation_id: str,
    actor: ConsoleActorDep,
    agent: AgentDep,
    work: WorkDep,
    category_id: Annotated[str, Form()] = "",
    name: Name = "",
) -> Response:
    """What it was really of; a new category where none is named."""
    given = (category_id or None, None if category_id else name.strip() or None)
    await work.run(lambda: agent.curation.correct(observation_id, *given, actor=actor))
    return Response(status_code=204, headers={"HX-Refresh": "true"})


def learnt_from(agent: Agent, observations: Sequence[Observation]) -> dict[str, str]:
    """Of those whose object was scanned: by their ids the categories that this made."""
    scans = {seen.id: agent.memory.scans.get(seen.scan_id) for seen in observations if seen.scan_id is not None}
    return {observation_id: scan.category_id for observation_id, scan in scans.items() if scan.category_id is not None}


def _evidence(agent: Agent, seen: Observation) -> dict[str, Any]:
    """What the pose rests on, where it has one, its category is there, and its arrays are sound."""
    none = {"matrix": None, "view": None, "damage": None}
    if seen.pose is None or seen.category_id is None:
        return none
    try:
        details = pose_details_from_arrays(agent.memory.observations.features(seen.id))
    except Unavailable as error:
        return none | {"damage": str(error)}
    if details is None or not details.pairs:
        return none
    return {"matrix": Matrix.of(details), "view": details.matches.best_pair(details.pairs)[1], "damage": None}
