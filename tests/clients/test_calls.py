"""The client covers the service: every endpoint is one of its calls."""

from __future__ import annotations

import inspect
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

import numpy as np

import clients.calls
from clients.asynchronous import AsyncRobotClient
from clients.calls.call import Call
from clients.calls.observing import observe
from clients.robot import RobotClient, Scan
from core.views import Burst, View
from service.app import create_app
from service.schemas.observations import ObserveQuery
from service.settings import Settings

MODULES = [import_module(f"clients.calls.{file.name}") for file in iter_modules(clients.calls.__path__) if file.name != "call"]
EXAMPLES: dict[str, Any] = {
    "burst": Burst([View(np.zeros((32, 32, 3), np.uint8))]),
    "source": "o",
    "path": "/v1/x.png",
    "archive": b"PK",
    "false_known_rate": 0.1,
}
"""Of parameters that are no id; an id is written as its path has it."""
OF_A_SCAN = {"add_views": "add", "complete_scan": "complete", "exclude_viewpoints": "exclude"}
"""Calls that are methods of a scan."""
ELSEWHERE = {
    ("GET", "/healthz"): "for whoever watches the process",
    ("GET", "/readyz"): "for whoever watches the process",
    ("GET", "/metrics"): "for whoever watches the process",
    ("GET", "/v1/events"): "a stream: a method of its own",
    ("GET", "/v1/memory/audit"): "for whoever keeps the memory",
    ("POST", "/v1/memory/audit/{entry_id}/undo"): "for whoever keeps the memory",
}
"""Endpoints that are no call."""
STREAMS = {"events", "track"}


def calls() -> dict[str, Call[Any]]:
    """Every call, with placeholders for its ids."""
    functions = {name: each for module in MODULES for name, each in vars(module).items() if _is_call(each, module)}
    return {name: function(**_arguments(function)) for name, function in functions.items()}


def _is_call(each: Any, module: Any) -> bool:
    return inspect.isfunction(each) and each.__module__ == module.__name__


def _arguments(function: Any) -> dict[str, Any]:
    required = [
        name
        for name, each in inspect.signature(function).parameters.items()
        if each.default is each.empty and each.kind != each.VAR_KEYWORD
    ]
    return {name: EXAMPLES.get(name, f"{{{name}}}") for name in required}


def test_every_endpoint_but_pictures_is_a_call() -> None:
    paths = create_app(Settings()).openapi()["paths"]
    endpoints = {(method.upper(), path) for path, methods in paths.items() for method in methods if not path.endswith(".png")}
    made = {(call.method, call.path) for name, call in calls().items() if name != "picture"}
    assert endpoints - set(ELSEWHERE) == made


def test_every_option_of_an_observation_is_one_of_its_call() -> None:
    given = {each.name for each in inspect.signature(observe).parameters.values() if each.kind is each.KEYWORD_ONLY}
    assert given - {"frame", "debug", "exact"} == set(ObserveQuery.model_fields)


def test_every_call_is_a_method_of_both_clients() -> None:
    methods = {name for name in calls() if name not in OF_A_SCAN}
    for client in (RobotClient, AsyncRobotClient):
        assert methods == {name for name in vars(client) if not name.startswith("_")} - {"send", "close"} - STREAMS
    assert all(hasattr(Scan, name) for name in OF_A_SCAN.values())
