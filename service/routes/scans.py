"""/v1/scans: the views a robot brings so that a novel object becomes a category."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Request
from fastapi.exceptions import RequestValidationError
from pydantic import ValidationError

from core.reference import MIN_VIEWS
from core.views import Burst
from service.deps import AgentDep, LaneDep, UploadDep, media_type, read_upload
from service.schemas.bursts import BURST_BODY
from service.schemas.categories import Category
from service.schemas.problem import problems
from service.schemas.scans import Scan, ScanBegin, ScanComplete
from store import records

router = APIRouter(prefix="/v1/scans", tags=["scans"])

BEGIN_BODY: dict[str, Any] = {
    "required": True,
    "content": BURST_BODY["content"] | {"application/json": {"schema": {"$ref": "#/components/schemas/ScanBegin"}}},
}


async def _source(request: Request) -> Burst | str:
    """The burst in the body, or the id of an observation."""
    if media_type(request) != "application/json":
        return (await read_upload(request)).burst
    try:
        return ScanBegin.model_validate_json(await request.body()).observation_id
    except ValidationError as error:
        raise RequestValidationError(error.errors()) from None


@router.post("", status_code=201, responses=problems(404, 413, 415, 422, 503), openapi_extra={"requestBody": BEGIN_BODY})
async def begin_scan(source: Annotated[Burst | str, Depends(_source)], agent: AgentDep, lane: LaneDep) -> Scan:
    """Viewpoints to look from at the object of a burst, or of an earlier observation: a scan whatever was decided then."""
    return await lane.run(lambda: scan_answer(agent.begin_scan(source)))


@router.get("/{scan_id}", responses=problems(404, 422))
def get_scan(scan_id: str, agent: AgentDep) -> Scan:
    """How far a scan is."""
    return scan_answer(agent.memory.scans.get(scan_id))


@router.delete("/{scan_id}", status_code=204, responses=problems(404, 422, 503))
def delete_scan(scan_id: str, agent: AgentDep) -> None:
    """Forgets a scan and the views it received; a category that it made stays."""
    agent.memory.scans.delete(scan_id)


@router.post("/{scan_id}/views", responses=problems(404, 409, 413, 415, 422, 503), openapi_extra={"requestBody": BURST_BODY})
async def add_scan_views(scan_id: str, upload: UploadDep, agent: AgentDep, lane: LaneDep) -> Scan:
    """Adds views, one or several at a time, in the world frame of the burst that the scan came from."""
    return await lane.run(lambda: scan_answer(agent.add_views(scan_id, upload.burst)))


@router.post("/{scan_id}/complete", status_code=201, responses=problems(404, 409, 422, 503))
async def complete_scan(scan_id: str, agent: AgentDep, lane: LaneDep, complete: ScanComplete | None = None) -> Category:
    """Makes the scan's views a category, in one step."""
    name = complete.name if complete else None
    return await lane.run(lambda: Category.of(agent.complete_scan(scan_id, name)))


def scan_answer(scan: records.Scan) -> Scan:
    """As JSON."""
    return Scan.of(scan, views_required=MIN_VIEWS)
