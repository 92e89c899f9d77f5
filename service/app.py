"""The application: `create_app(settings)` is all a server needs."""

from __future__ import annotations

import logging
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from importlib.metadata import version

import anyio
import numpy as np
from anyio.to_thread import run_sync
from fastapi import FastAPI

from core.backbones import EMBEDDED, load_backbone
from core.backbones.base import Backbone
from core.calibration import Prior
from core.encode import EncoderConfig
from core.errors import OneLookError
from core.scores import BEST
from core.warm import WarmConfig
from service import errors
from service.agent import Agent, AgentConfig
from service.auth import Guard
from service.batching import BatchingBackbone
from service.browsers import OwnPagesOnly
from service.compute import Compute, in_this_process
from service.console.demo import Demo
from service.console.install import install as install_console
from service.events import Event, Events
from service.limits import BodyLimits
from service.logs import Logged, log_event
from service.metrics import Measured, Metrics
from service.routes.install import MADE
from service.routes.install import install as install_endpoints
from service.settings import Settings
from service.state import Running
from store.memory import Memory

DESCRIPTION = """A growing memory of object categories for robots: look once at one object, then find and pose others of its kind.

Lengths are metres, camera axes are OpenCV's (x right, y down, z forward), quaternions are (w, x, y, z); `b_from_a` maps points of frame a
to frame b.
Every error is `application/problem+json` (RFC 9457)."""
PRUNE_EVERY_S = 3600
log = logging.getLogger("onelook")


def create_app(
    settings: Settings,
    *,
    backbone: Backbone | None = None,
    compute: Compute | None = None,
    asks: bool = True,
    warm: WarmConfig = WarmConfig(),
) -> FastAPI:
    """The service with these settings; it opens its memory and loads its backbone (unless one is given) when it starts.

    `compute` is given where others have the backbone. `asks` is False where nobody but this process reaches it: then it asks for no key.
    `warm` is how objects are followed.
    """
    metrics = Metrics()

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        with open_agent(settings, metrics, backbone, compute) as agent:
            app.state.running = Running(
                settings=settings,
                metrics=metrics,
                agent=agent,
                guard=Guard(agent.memory.keys, agent.memory.sessions, settings.rate_limit, asks=asks),
                work=metrics.watched_queue(settings.workers, settings.queue, settings.deadline_s),
                demo=Demo(),
                made=MADE,
                tracks=set(),
                warm=warm,
            )
            metrics.tell_build(agent.backbone.name)
            async with _working(app.state.running):
                yield

    app = FastAPI(
        title="OneLook",
        version=version("onelook"),
        description=DESCRIPTION,
        lifespan=lifespan,
        generate_unique_id_function=lambda route: route.name,
    )
    app.add_middleware(BodyLimits, max_mb=settings.max_upload_mb, bodies=settings.workers + settings.queue, deadline_s=settings.deadline_s)
    app.add_middleware(OwnPagesOnly)
    app.add_middleware(Measured, metrics=metrics)
    app.add_middleware(Logged)
    errors.install(app)
    install_endpoints(app)
    install_console(app)
    return app


@asynccontextmanager
async def _working(running: Running) -> AsyncIterator[None]:
    """Prunes the memory meanwhile; ends once all work has, after which the memory may be closed."""
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(_keep_pruned, running.agent.memory)
        try:
            yield
        finally:
            running.work.stop()
            await run_sync(running.demo.close)
            await running.work.finished()
        tasks.cancel_scope.cancel()


async def _keep_pruned(memory: Memory) -> None:
    """Ends what has an end; see `Memory.prune`."""
    while True:
        await anyio.sleep(PRUNE_EVERY_S)
        try:
            await run_sync(memory.prune)
        except OneLookError as error:  # a full disk; /readyz says so, and the next round may do it
            log.warning("cannot drop what is over: %s", error)


@contextmanager
def open_agent(settings: Settings, metrics: Metrics, backbone: Backbone | None, compute: Compute | None) -> Iterator[Agent]:
    """The agent of these settings, with its memory open until the end; loads its backbone unless one, or what computes, is given.

    Raises what `Settings`, `Memory.open`, `load_backbone` and `Agent` raise.
    """
    with _checked(settings) as (opened, config):

        def tell(event: Event) -> None:
            metrics.count_event(event)
            log_event(event)

        chosen = compute or in_this_process(BatchingBackbone(backbone or warm_backbone(settings), metrics.count_pass, settings.deadline_s))
        agent = Agent(chosen, opened, config, Events(tell))
        if config.score == BEST and config.threshold is None and agent.backbone.fingerprint != Prior.shipped().fingerprint:
            log.warning("thresholds start from figures of another backbone, %s, until the memory has decisions of its own", EMBEDDED)
        try:
            yield agent
        finally:
            agent.events.close()


def checked_backbone(settings: Settings) -> Backbone:
    """The backbone of these settings, once all is checked that can keep the service from starting. Raises as `open_agent` does."""
    with _checked(settings) as (opened, _):
        loaded = warm_backbone(settings)
        opened.require_backbone(loaded.name, loaded.fingerprint)
        return loaded


def require_startable(settings: Settings) -> None:
    """Raises what would keep the service from starting, but for its backbone."""
    with _checked(settings):
        pass


@contextmanager
def _checked(settings: Settings) -> Iterator[tuple[Memory, AgentConfig]]:
    """What is wrong with the settings is told before a backbone is loaded, which takes long."""
    settings.require_consistent()
    config = AgentConfig(
        score=settings.score,
        threshold=settings.threshold,
        variant=settings.variant,
        scan_views=settings.scan_views,
        false_known_rate=settings.false_known_rate,
    )
    config.validate()
    with Memory.open(settings.data_dir, settings.retention) as opened:
        settings.require_safe(len(opened.keys.all()))
        yield opened, config


def warm_backbone(settings: Settings) -> Backbone:
    """Loaded, and used once: whoever is answered first does not wait for memory and kernels."""
    loaded = load_backbone(settings.backbone, device=settings.device, report=log.info)
    side = EncoderConfig().grid * loaded.patch_size
    started = time.perf_counter()
    loaded.extract(np.zeros((1, side, side, 3), np.uint8))
    log.info("warmed up", extra={"about": {"backbone": loaded.name, "seconds": round(time.perf_counter() - started, 3)}})
    return loaded
