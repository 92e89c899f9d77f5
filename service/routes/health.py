"""Probes, figures, and what the service says of itself."""

from __future__ import annotations

from importlib.metadata import version

from fastapi import APIRouter, Request, Response

from core.errors import OneLookError, Unavailable
from service.batching import HANGS
from service.deps import AgentDep, MetricsDep
from service.guarded import GuardedRoute
from service.schemas.info import Health, Info
from service.schemas.problem import problems
from service.state import running

router = APIRouter(tags=["operations"], route_class=GuardedRoute)


@router.get("/healthz")
def healthz() -> Health:
    """The process answers."""
    return Health()


@router.get("/readyz", responses=problems(503))
def readyz(request: Request, agent: AgentDep) -> Health:
    """The backbone is loaded and works, the memory can be read and written, and a worker is there for whoever asks."""
    wrong = []
    for part in (agent.memory, agent.backbone):
        try:
            part.require_sound()
        except OneLookError as error:
            wrong.append(str(error))
    stuck_s = running(request).work.stuck_s()
    if stuck_s is not None:
        wrong.append(f"all workers have been held for {stuck_s:.0f} s by requests that were given up (ONELOOK_DEADLINE_S); {HANGS}")
    if wrong:
        raise Unavailable("; and ".join(wrong))
    return Health()


@router.get("/v1/info")
def info(agent: AgentDep) -> Info:
    """Version, backbone, decision and memory."""
    return Info(
        version=version("onelook"),
        backbone=agent.backbone.name,
        fingerprint=agent.backbone.fingerprint,
        score=agent.config.score,
        threshold=agent.config.threshold,
        false_known_rate=agent.upkeep.false_known_rate,
        variant=agent.config.variant,
        categories=len(agent.memory.categories.all()),
        memory_version=agent.memory.version,
    )


@router.get(
    "/metrics",
    response_class=Response,
    responses={200: {"description": "Prometheus's text format", "content": {"text/plain": {}}}, **problems(503)},
)
def metrics(agent: AgentDep, counted: MetricsDep) -> Response:
    """Figures for Prometheus."""
    return Response(counted.text(agent.memory), media_type="text/plain; version=0.0.4")
