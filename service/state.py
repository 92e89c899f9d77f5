"""What the application keeps for its requests, by its types."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from pydantic import BaseModel
from starlette.datastructures import QueryParams
from starlette.requests import HTTPConnection

from core.warm import WarmConfig
from service.agent import Agent
from service.auth import Guard
from service.console.demo import Demo
from service.metrics import Metrics
from service.settings import Settings
from service.work import WorkQueue

MadeAnswer = Callable[[Agent, str, QueryParams], BaseModel]
"""What a route answers, from the id of what a request made and the options of that request."""
Made = Mapping[str, MadeAnswer]
"""By the path of the route."""


@dataclass(frozen=True, eq=False)
class Running:
    """From the start of an application to its end."""

    settings: Settings
    metrics: Metrics
    agent: Agent
    guard: Guard
    work: WorkQueue
    demo: Demo
    made: Made
    """What a repeated request is answered with where its first answer was lost."""
    tracks: set[HTTPConnection]
    """Each follows an object."""
    warm: WarmConfig
    """How objects are followed."""
    run_id: str = field(default_factory=lambda: uuid.uuid4().hex)
    """Another one at each start."""


def running(connection: HTTPConnection) -> Running:
    """Of the application that is asked."""
    found: Running = connection.app.state.running
    return found
