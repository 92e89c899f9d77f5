"""The application: `create_app(settings)` is all a server needs."""

from __future__ import annotations

import logging
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from importlib.metadata import version

from fastapi import FastAPI

from core.backbones.base import Backbone
from core.backbones.dino import load_backbone
from core.novelty import named_score
from service import errors, openapi
from service.agent import Agent, AgentConfig
from service.deps import Lane
from service.limits import UploadLimit
from service.routes import categories, health, observations, scans
from service.settings import Settings
from store.memory import Memory

DESCRIPTION = """A growing memory of object categories for robots: look once at one object, then find and pose others of its kind.

Lengths are metres, camera axes are OpenCV's (x right, y down, z forward), quaternions are (w, x, y, z); `b_from_a` maps points of frame a
to frame b.
Every error is `application/problem+json` (RFC 9457)."""
log = logging.getLogger("onelook")


def create_app(settings: Settings, *, backbone: Backbone | None = None) -> FastAPI:
    """The service with these settings; it opens its memory and loads its backbone (unless one is given) when it starts."""

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        with open_agent(settings, backbone) as agent:
            app.state.agent = agent
            app.state.lane = Lane()
            yield

    app = FastAPI(
        title="OneLook",
        version=version("onelook"),
        description=DESCRIPTION,
        lifespan=lifespan,
        generate_unique_id_function=lambda route: route.name,
    )
    app.state.settings = settings
    app.add_middleware(UploadLimit, max_mb=settings.max_upload_mb)
    errors.install(app)
    openapi.install(app)
    for module in (observations, scans, categories, health):
        app.include_router(module.router)
    return app


@contextmanager
def open_agent(settings: Settings, backbone: Backbone | None = None) -> Iterator[Agent]:
    """The agent of these settings, with its memory open until the end; loads its backbone unless one is given.

    Raises what `Memory.open`, `load_backbone` and `Agent` raise.
    """
    config = agent_config(settings)
    with Memory.open(settings.data_dir) as memory:
        loaded = backbone or load_backbone(settings.backbone, device=settings.device, report=log.info)
        yield Agent(loaded, memory, config)


def agent_config(settings: Settings) -> AgentConfig:
    """What the agent takes from the settings. Raises InvalidInput for an unknown score."""
    threshold = named_score(settings.score).threshold if settings.threshold is None else settings.threshold
    return AgentConfig(settings.score, threshold, settings.variant, settings.scan_views)
