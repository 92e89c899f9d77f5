"""Figures for Prometheus, of one application."""

from __future__ import annotations

import time
from collections.abc import Callable
from importlib.metadata import version
from typing import get_args

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, ProcessCollector, generate_latest
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from core.novelty import Outcome
from service.events import Event
from service.work import Refusal, WorkQueue
from store.memory import Memory
from store.records import ScanState

SECONDS = (0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30, 100)
IMAGES = (1, 2, 4, 8, 16, 32, 64)


class Metrics:
    """What is counted."""

    def __init__(self) -> None:
        self._registry = CollectorRegistry()
        ProcessCollector(registry=self._registry)
        self._build = Gauge("onelook_build_info", "Of the service and its backbone.", ("version", "backbone"), registry=self._registry)
        self._requests = Counter("onelook_requests", "Requests answered.", ("method", "route", "status"), registry=self._registry)
        self._request_seconds = Histogram(
            "onelook_request_seconds",
            "From a request's arrival to the end of its answer.",
            ("method", "route"),
            buckets=SECONDS,
            registry=self._registry,
        )
        self._pass_images = Histogram(
            "onelook_backbone_pass_images", "Images of one pass of the backbone.", buckets=IMAGES, registry=self._registry
        )
        self._stage_seconds = Histogram(
            "onelook_stage_seconds", "Of the stages of an observation.", ("stage",), buckets=SECONDS, registry=self._registry
        )
        self._events = Counter("onelook_events", "What happened, as /v1/events tells it.", ("kind",), registry=self._registry)
        self._observations = Counter("onelook_observations", "Observations decided.", ("outcome",), registry=self._registry)
        for outcome in get_args(Outcome):
            self._observations.labels(outcome)  # a rate needs its zero
        self._waited = Histogram(
            "onelook_work_wait_seconds", "From a request's arrival to the begin of its work.", buckets=SECONDS, registry=self._registry
        )
        self._refused = Counter("onelook_work_refused", "Requests sent away.", ("reason",), registry=self._registry)
        for reason in get_args(Refusal):
            self._refused.labels(reason)
        self._scans = Gauge("onelook_scans", "Scans that the memory knows of.", ("state",), registry=self._registry)
        self._kept = Gauge("onelook_memory_kept", "What the memory holds.", ("kind",), registry=self._registry)
        self._bytes = Gauge("onelook_memory_bytes", "What the memory takes on disk, the bin included.", registry=self._registry)
        self._version = Gauge("onelook_memory_version", "Grows with each change of the memory.", registry=self._registry)

    def watched_queue(self, workers: int, queue: int, deadline_s: float) -> WorkQueue:
        """A queue whose length and refusals are shown."""
        work = WorkQueue(workers, queue, deadline_s, self._waited.observe, lambda why: self._refused.labels(why).inc())
        shown: dict[str, tuple[str, Callable[[], float]]] = {
            "onelook_work_running": ("Requests that are worked on.", lambda: work.running),
            "onelook_work_waiting": ("Requests that wait.", lambda: work.waiting),
            "onelook_work_places": ("Requests that may be worked on or wait.", lambda: workers + queue),
        }
        for name, (says, value) in shown.items():
            Gauge(name, says, registry=self._registry).set_function(value)
        return work

    def tell_build(self, backbone: str) -> None:
        """Shows what answers."""
        self._build.labels(version("onelook"), backbone).set(1)

    def count_pass(self, images: int) -> None:
        """One pass of the backbone."""
        self._pass_images.observe(images)

    def count_event(self, event: Event) -> None:
        """One thing that happened."""
        self._events.labels(event.kind).inc()
        if event.kind == "observation":
            self._observations.labels(event.about["outcome"]).inc()
            for stage, milliseconds in event.about["timings_ms"].items():
                self._stage_seconds.labels(stage).observe(milliseconds / 1e3)

    def count_request(self, method: str, route: str, status: int, seconds: float) -> None:
        """One answer."""
        self._requests.labels(method, route, status).inc()
        self._request_seconds.labels(method, route).observe(seconds)

    def text(self, memory: Memory) -> bytes:
        """In Prometheus's text format."""
        sizes = memory.sizes()
        for kind in ("categories", "instances", "observations", "scans", "goals"):
            self._kept.labels(kind).set(getattr(sizes, kind))
        self._bytes.set(sizes.size)
        states = memory.scans.states()
        for state in get_args(ScanState):
            self._scans.labels(state).set(states.get(state, 0))
        self._version.set(memory.version)
        return generate_latest(self._registry)


class Measured:
    """Counts every answer under its route, not its path: ids would make a series each."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self._app = app
        self._metrics = metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One connection."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        start, status = time.perf_counter(), 500

        async def noted(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        try:
            await self._app(scope, receive, noted)
        finally:
            route = getattr(scope.get("route"), "path", "none")
            self._metrics.count_request(scope["method"], route, status, time.perf_counter() - start)
