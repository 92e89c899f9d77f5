"""Probes, and what the service says of itself."""

from __future__ import annotations

from importlib.metadata import version

from fastapi import APIRouter

from service.auth import GuardedRoute
from service.deps import AgentDep
from service.schemas.info import Health, Info
from service.schemas.problem import problems

router = APIRouter(tags=["operations"], route_class=GuardedRoute)


@router.get("/healthz")
def healthz() -> Health:
    """The process answers."""
    return Health()


@router.get("/readyz", responses=problems(503))
def readyz(agent: AgentDep) -> Health:
    """The backbone is loaded and the memory answers."""
    agent.memory.ping()
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
