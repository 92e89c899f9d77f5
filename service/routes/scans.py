"""/v1/scans: the views a robot brings so that a novel object becomes a category."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query

from service.deps import ActorDep, AgentDep, SentDep, UploadDep, WorkDep
from service.exchange import MemoryRoute
from service.routes.answers import by_id, category, scan, scan_answer
from service.schemas.bursts import BURST_BODY, burst_or_seen
from service.schemas.categories import Category
from service.schemas.problem import problems
from service.schemas.scans import Scan, ScanComplete, ScanExclude, ScanList, ScanQuery

router = APIRouter(prefix="/v1/scans", tags=["scans"], route_class=MemoryRoute)


@router.post(
    "",
    status_code=201,
    responses=problems(404, 413, 415, 422, 503),
    openapi_extra={"requestBody": burst_or_seen("an observation whose views have cameras and depth")},
)
async def begin_scan(
    read: SentDep,
    query: Annotated[ScanQuery, Query()],
    agent: AgentDep,
    work: WorkDep,
) -> Scan:
    """Viewpoints to look from at the object of a burst, or of an earlier observation: a scan whatever was decided then."""
    options = query.options(agent.config.scan_views)
    return await work.run(lambda: scan_answer(agent, agent.scanning.begin(read().source, options)))


@router.get("", responses=problems(422))
def list_scans(agent: AgentDep, limit: Annotated[int, Query(ge=1, le=1000, description="Most to list.")] = 50) -> ScanList:
    """Those in progress, the latest begun first."""
    return ScanList(scans=[scan_answer(agent, found) for found in agent.memory.scans.in_progress(limit)])


@router.get("/{scan_id}", responses=problems(404, 422))
def get_scan(scan_id: str, agent: AgentDep) -> Scan:
    """How far a scan is."""
    return scan(agent, scan_id)


@router.delete("/{scan_id}", status_code=204, responses=problems(404, 422, 503))
def delete_scan(scan_id: str, agent: AgentDep) -> None:
    """Forgets a scan and the views it received; a category that it made stays."""
    agent.scanning.delete(scan_id)


@router.post("/{scan_id}/exclude", responses=problems(404, 409, 422, 503))
def exclude_viewpoints(scan_id: str, unreachable: ScanExclude, agent: AgentDep) -> Scan:
    """Replaces viewpoints that the robot cannot reach, each in its place, by directions that are not near any of them."""
    return scan_answer(agent, agent.scanning.exclude(scan_id, unreachable.viewpoints))


@router.post("/{scan_id}/views", responses=problems(404, 409, 413, 415, 422, 503), openapi_extra={"requestBody": BURST_BODY})
async def add_scan_views(scan_id: str, upload: UploadDep, agent: AgentDep, work: WorkDep) -> Scan:
    """Adds views, one or several at a time, in the world frame of the burst that the scan came from."""
    return await work.run(lambda: scan_answer(agent, agent.scanning.add(scan_id, upload().burst)))


@router.post("/{scan_id}/complete", status_code=201, responses=problems(404, 409, 422, 503))
async def complete_scan(scan_id: str, agent: AgentDep, work: WorkDep, actor: ActorDep, complete: ScanComplete | None = None) -> Category:
    """Makes the scan's views a category, in one step."""
    name = complete.name if complete else None
    return await work.run(lambda: Category.of(agent.scanning.complete(scan_id, name, actor=actor)))


MADE = {
    "/v1/scans": by_id(scan),
    "/v1/scans/{scan_id}/exclude": by_id(scan),
    "/v1/scans/{scan_id}/views": by_id(scan),
    "/v1/scans/{scan_id}/complete": by_id(category),
}
"""What a repeated request is answered with where its first answer was lost."""
