"""What the application keeps for its requests, and what is known of a request, by their types."""

from __future__ import annotations

from starlette.requests import HTTPConnection

from service.agent import Agent
from service.auth import Caller
from service.metrics import Metrics
from service.settings import Settings


def agent_of(connection: HTTPConnection) -> Agent:
    """The application's."""
    agent: Agent = connection.app.state.agent
    return agent


def settings_of(connection: HTTPConnection) -> Settings:
    """The application's."""
    settings: Settings = connection.app.state.settings
    return settings


def metrics_of(connection: HTTPConnection) -> Metrics:
    """The application's."""
    metrics: Metrics = connection.app.state.metrics
    return metrics


def caller_of(connection: HTTPConnection) -> Caller:
    """Whom the guard let in."""
    caller: Caller = connection.state.caller
    return caller
