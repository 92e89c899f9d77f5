"""/v1/memory: its size, and copies of it that go elsewhere."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, BackgroundTasks, Query, Request, Response
from fastapi.responses import FileResponse
from starlette.exceptions import HTTPException

from service.agent import Agent
from service.deps import ActorDep, AgentDep, SettingsDep, WorkDep
from service.exchange import MemoryRoute
from service.guarded import GuardedRoute
from service.limits import media_type
from service.routes.answers import by_id
from service.schemas.memory import AuditEntry, AuditList, Backup, Calibrate, ExportQuery, Import, MemoryInfo, Thresholds
from service.schemas.problem import problems

router = APIRouter(tags=["memory"], route_class=MemoryRoute)
live = APIRouter(tags=["memory"], route_class=GuardedRoute)
"""What is new at each call, and so has no ETag."""
ARCHIVE = "application/zip"
ARCHIVE_BODY: dict[str, Any] = {"required": True, "content": {ARCHIVE: {"schema": {"type": "string", "format": "binary"}}}}


@live.get("/v1/memory", responses=problems(503))
def memory(agent: AgentDep) -> MemoryInfo:
    """What it holds, what it was made with, and how it decides."""
    return MemoryInfo.of(agent)


@router.post("/v1/memory/calibrate", responses=problems(409, 422, 503))
def calibrate_memory(calibrate: Calibrate, agent: AgentDep, actor: ActorDep) -> Thresholds:
    """Keeps with the memory how many objects of no known category it may call known, and answers the thresholds that this makes."""
    return Thresholds.of(agent.upkeep.calibrate(calibrate.false_known_rate, actor=actor))


@live.post("/v1/memory/backup", status_code=201, responses=problems(409, 422, 503))
async def backup_memory(agent: AgentDep, work: WorkDep, settings: SettingsDep, actor: ActorDep) -> Backup:
    """Copies the whole memory, while it is used, to a new folder in ONELOOK_BACKUP_DIR; the copy opens as a memory."""
    return await work.run_endless(lambda: Backup.of(agent.upkeep.backup(settings.backups, actor=actor)))


@live.post(
    "/v1/memory/export",
    response_class=Response,
    responses={200: {"description": "An archive", "content": {ARCHIVE: {}}}, **problems(404, 409, 422, 503)},
)
async def export_memory(
    query: Annotated[ExportQuery, Query()], agent: AgentDep, work: WorkDep, after: BackgroundTasks, actor: ActorDep
) -> Response:
    """Categories, all of them or some, with their references, instances and goals, as one file for another robot's memory."""
    folder = tempfile.TemporaryDirectory()
    path = Path(folder.name) / "memory.zip"
    try:
        await work.run_endless(lambda: agent.upkeep.export(path, query.category_id or None, actor=actor))
    except BaseException:
        folder.cleanup()
        raise
    after.add_task(folder.cleanup)
    return FileResponse(path, media_type=ARCHIVE, filename="memory.zip", background=after)


@router.post("/v1/memory/import", status_code=201, responses=problems(409, 413, 415, 422, 503), openapi_extra={"requestBody": ARCHIVE_BODY})
async def import_memory(request: Request, agent: AgentDep, work: WorkDep, actor: ActorDep) -> Import:
    """Takes in the categories of another memory's export: all, or none where anything is wrong; those it has already stay as they are."""
    if media_type(request.headers) != ARCHIVE:
        raise HTTPException(
            415, f"the body is {media_type(request.headers) or 'of no media type'}; send the file of an export as {ARCHIVE}"
        )
    body = await request.body()
    return await work.run_endless(lambda: _import(agent, body, actor))


@router.get("/v1/memory/audit", responses=problems(422))
def list_changes(agent: AgentDep, limit: Annotated[int, Query(ge=1, le=1000, description="Most to list.")] = 50) -> AuditList:
    """The latest changes of what was learnt, newest first: who, what, when, and how it was before and after."""
    return AuditList(entries=[AuditEntry.of(entry) for entry in agent.memory.audit.latest(limit)])


@router.post("/v1/memory/audit/{entry_id}/undo", responses=problems(404, 409, 422, 503))
def undo_change(entry_id: str, agent: AgentDep, actor: ActorDep) -> AuditEntry:
    """Takes back a rename, merge, split, correction, forgotten burst or deletion; answers the entry that says so."""
    return AuditEntry.of(agent.upkeep.undo(entry_id, actor=actor))


def imported(agent: Agent, entry_id: str) -> Import:
    """What an import brought, from the audit trail."""
    after = agent.memory.audit.get(entry_id).after
    return Import.of(agent, entry_id, after["categories"], after["duplicates"])


def change(agent: Agent, entry_id: str) -> AuditEntry:
    """One of the audit trail, as JSON."""
    return AuditEntry.of(agent.memory.audit.get(entry_id))


MADE = {"/v1/memory/import": by_id(imported), "/v1/memory/audit/{entry_id}/undo": by_id(change)}
"""What a repeated request is answered with where its first answer was lost."""


def _import(agent: Agent, body: bytes, actor: str | None) -> Import:
    brought = agent.upkeep.import_archive(body, actor=actor)
    ids, duplicates = ([each.id for each in part] for part in (brought.categories, brought.duplicates))
    return Import.of(agent, brought.entry_id, ids, duplicates)
