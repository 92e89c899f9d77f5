"""POST /v1/observations, and the history with its pictures."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response

from core.errors import InvalidInput
from core.views import Burst
from service.agent import Agent, ObserveOptions
from service.deps import AgentDep, LaneDep, UploadDep
from service.features import pose_details_from_arrays
from service.gallery import ObservationGallery
from service.routes.png import PNG_RESPONSES, png
from service.routes.scans import scan_answer
from service.schemas.bursts import BURST_BODY
from service.schemas.observations import Debug, Observation, ObservationList, ObserveQuery
from service.schemas.problem import problems
from store import records

router = APIRouter(prefix="/v1/observations", tags=["observations"])

Include = Annotated[list[Literal["debug"]], Query(description="`debug` adds what the pose was computed from.")]
ViewIndex = Annotated[int, Query(ge=0, description="Which of the burst's views, from 0.")]


@router.post("", status_code=201, responses=problems(404, 413, 415, 422, 503), openapi_extra={"requestBody": BURST_BODY})
async def observe(upload: UploadDep, query: Annotated[ObserveQuery, Query()], agent: AgentDep, lane: LaneDep) -> Observation:
    """Decides what a burst shows: a known object is answered with its pose and joins its category, a novel one with a scan to carry out."""
    burst = _first_views(upload.burst, query.views_used)
    options = ObserveOptions(query.category_id, query.threshold, query.variant, query.learn, query.seed)
    debug = "debug" in query.include
    return await lane.run(lambda: _answer(agent, agent.observe(burst, options, frame=upload.frame), debug=debug))


@router.get("", responses=problems(422))
def list_observations(agent: AgentDep, limit: Annotated[int, Query(ge=1, le=1000, description="Most to list.")] = 50) -> ObservationList:
    """The latest observations, newest first."""
    return ObservationList(observations=[_answer(agent, seen) for seen in agent.memory.observations.latest(limit)])


@router.get("/{observation_id}", responses=problems(404, 422))
def get_observation(observation_id: str, agent: AgentDep, include: Include = []) -> Observation:  # noqa: B006 - FastAPI copies defaults
    """What was answered then."""
    return _answer(agent, agent.memory.observations.get(observation_id), debug="debug" in include)


@router.get("/{observation_id}/rgb.png", response_class=Response, responses=PNG_RESPONSES)
def observation_rgb(observation_id: str, agent: AgentDep, view: ViewIndex = 0) -> Response:
    """A view as it came."""
    return png(ObservationGallery(agent, observation_id).rgb(view))


@router.get("/{observation_id}/foreground.png", response_class=Response, responses=PNG_RESPONSES)
def observation_foreground(observation_id: str, agent: AgentDep, view: ViewIndex = 0) -> Response:
    """The close crop of a view with everything dimmed that is not taken for the object."""
    return png(ObservationGallery(agent, observation_id).foreground(view))


@router.get("/{observation_id}/pca.png", response_class=Response, responses=PNG_RESPONSES)
def observation_pca(observation_id: str, agent: AgentDep, view: ViewIndex = 0) -> Response:
    """The object's patches coloured by their first three principal components: those of its category where it has one, else its own."""
    return png(ObservationGallery(agent, observation_id).pca(view))


@router.get("/{observation_id}/overlay.png", response_class=Response, responses=PNG_RESPONSES)
def observation_overlay(observation_id: str, agent: AgentDep, view: ViewIndex = 0) -> Response:
    """A view with the oriented box drawn at the estimated pose; the object's x, y and z axes are red, green and blue."""
    return png(ObservationGallery(agent, observation_id).overlay(view))


@router.get("/{observation_id}/correspondences.png", response_class=Response, responses=PNG_RESPONSES)
def observation_correspondences(
    observation_id: str,
    agent: AgentDep,
    view: Annotated[int | None, Query(ge=0, description="Which of the burst's views; the pose's `best_view` where left out.")] = None,
) -> Response:
    """The best reference view (left) and a view of the burst (right): inliers coloured by similarity, other correspondences grey."""
    return png(ObservationGallery(agent, observation_id).correspondences(view))


def _first_views(burst: Burst, count: int | None) -> Burst:
    if count is None:
        return burst
    if count > len(burst):
        raise InvalidInput("views_used", f"is {count}, the burst has {len(burst)} views; leave it out to use all")
    return burst.select(range(count))


def _answer(agent: Agent, seen: records.Observation, *, debug: bool = False) -> Observation:
    names = {category.id: category.name for category in agent.memory.categories.all()}
    scan = scan_answer(agent.memory.scans.get(seen.scan_id)) if seen.scan_id else None
    return Observation.of(seen, names, scan, _debug(agent, seen.id) if debug else None)


def _debug(agent: Agent, observation_id: str) -> Debug | None:
    details = pose_details_from_arrays(agent.memory.observations.features(observation_id))
    return Debug(view_similarity=details.view_similarity.tolist(), pairs=list(details.pairs)) if details else None
