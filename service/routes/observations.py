"""POST /v1/observations, and the history with its pictures."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Response
from starlette.datastructures import QueryParams

from core.errors import InvalidInput
from core.novelty import Outcome
from core.views import Burst
from service.agent import Agent
from service.deps import ActorDep, AgentDep, UploadDep, WorkDep
from service.exchange import MemoryRoute
from service.gallery import ObservationGallery
from service.routes.answers import by_id, observation, observation_answer
from service.routes.png import PNG_RESPONSES, Side, png
from service.schemas.bursts import BURST_BODY
from service.schemas.observations import AnswerQuery, Correction, NewObservationQuery, Observation, ObservationList
from service.schemas.problem import problems
from service.schemas.vision_msgs import Detection3DArray
from store import records

router = APIRouter(prefix="/v1/observations", tags=["observations"], route_class=MemoryRoute)

ViewIndex = Annotated[int, Query(ge=0, description="Which of the burst's views, from 0.")]
Shown = Observation | Detection3DArray
"""An observation in the shape that was asked for."""


@router.post("", status_code=201, responses=problems(404, 413, 415, 422, 503), openapi_extra={"requestBody": BURST_BODY})
async def observe(upload: UploadDep, query: Annotated[NewObservationQuery, Query()], agent: AgentDep, work: WorkDep) -> Shown:
    """Decides what a burst shows: a known object is answered with its pose and joins its category, a novel one with a scan to carry out."""
    options = query.options()

    def look() -> Shown:
        sent = upload()
        return _as_asked(agent, agent.observe(_first_views(sent.burst, query.views_used), options, frame=sent.frame), query)

    return await work.run(look)


@router.get("", responses=problems(404, 422))
def list_observations(
    agent: AgentDep,
    limit: Annotated[int, Query(ge=1, le=1000, description="Most to list.")] = 50,
    before: Annotated[str | None, Query(description="Only those older than this observation: the last one of the page before.")] = None,
    category_id: Annotated[str | None, Query(description="Only those recognised as this category.")] = None,
    outcome: Annotated[Outcome | None, Query(description="Only those decided so.")] = None,
) -> ObservationList:
    """The latest observations, newest first."""
    found = agent.memory.observations.latest(limit, before=before, category_id=category_id, outcome=outcome)
    return ObservationList(observations=[observation_answer(agent, seen) for seen in found])


@router.get("/{observation_id}", responses=problems(404, 422, 503))
def get_observation(observation_id: str, query: Annotated[AnswerQuery, Query()], agent: AgentDep) -> Shown:
    """What was answered then."""
    return _as_asked(agent, agent.memory.observations.get(observation_id), query)


@router.post("/{observation_id}/correct", responses=problems(404, 409, 422, 503))
async def correct_observation(observation_id: str, correction: Correction, agent: AgentDep, work: WorkDep, actor: ActorDep) -> Observation:
    """Says what it was really of: its burst joins that category and leaves the one it had joined; null makes a new one of its views."""
    said = correction.category_id, correction.name
    return await work.run(lambda: observation_answer(agent, agent.curation.correct(observation_id, *said, actor=actor)))


@router.get("/{observation_id}/rgb.png", response_class=Response, responses=PNG_RESPONSES)
def observation_rgb(observation_id: str, agent: AgentDep, view: ViewIndex = 0, side: Side = None) -> Response:
    """A view as it came."""
    return png(ObservationGallery(agent, observation_id).rgb(view), side)


@router.get("/{observation_id}/foreground.png", response_class=Response, responses=PNG_RESPONSES)
def observation_foreground(observation_id: str, agent: AgentDep, view: ViewIndex = 0, side: Side = None) -> Response:
    """The close crop of a view with everything dimmed that is not taken for the object."""
    return png(ObservationGallery(agent, observation_id).foreground(view), side)


@router.get("/{observation_id}/pca.png", response_class=Response, responses=PNG_RESPONSES)
def observation_pca(observation_id: str, agent: AgentDep, view: ViewIndex = 0, side: Side = None) -> Response:
    """The object's patches coloured by their first three principal components: those of its category where it has one, else its own."""
    return png(ObservationGallery(agent, observation_id).pca(view), side)


@router.get("/{observation_id}/overlay.png", response_class=Response, responses=PNG_RESPONSES)
def observation_overlay(observation_id: str, agent: AgentDep, view: ViewIndex = 0, side: Side = None) -> Response:
    """A view with the oriented box drawn at the estimated pose; the object's x, y and z axes are red, green and blue."""
    return png(ObservationGallery(agent, observation_id).overlay(view), side)


@router.get("/{observation_id}/correspondences.png", response_class=Response, responses=PNG_RESPONSES)
def observation_correspondences(
    observation_id: str,
    agent: AgentDep,
    view: Annotated[int | None, Query(ge=0, description="Which of the burst's views; the pose's `best_view` where left out.")] = None,
    side: Side = None,
) -> Response:
    """The best reference view (left) and a view of the burst (right): inliers coloured by similarity, other correspondences grey."""
    return png(ObservationGallery(agent, observation_id).correspondences(view), side)


def _first_views(burst: Burst, count: int | None) -> Burst:
    if count is None:
        return burst
    if count > len(burst):
        raise InvalidInput("views_used", f"is {count}, the burst has {len(burst)} views; leave it out to use all")
    return burst.select(range(count))


def _as_asked(agent: Agent, seen: records.Observation, query: AnswerQuery) -> Shown:
    if query.format == "vision_msgs":
        return Detection3DArray.of(seen, agent.names())
    return observation_answer(agent, seen, debug="debug" in query.include)


def _observed(agent: Agent, observation_id: str, query: QueryParams) -> Shown:
    asked = AnswerQuery(include=query.getlist("include"), format=query.get("format", "onelook"))
    return _as_asked(agent, agent.memory.observations.get(observation_id), asked)


MADE = {"/v1/observations": _observed, "/v1/observations/{observation_id}/correct": by_id(observation)}
"""What a repeated request is answered with where its first answer was lost."""
