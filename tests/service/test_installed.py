"""Every file with routes is installed, and no route is hidden by an earlier one."""

from __future__ import annotations

from pathlib import Path

import pytest

import service
from service.console.install import PAGES
from service.console.install import ROUTERS as CONSOLE
from service.guarded import GuardedRoute
from service.routes.install import ENDPOINTS, ROUTERS

ROOMS = {"routes": ENDPOINTS, "console": PAGES}


@pytest.mark.parametrize("room", ROOMS)
def test_every_file_with_a_router_is_listed(room: str) -> None:
    written = {file.stem for file in (Path(service.__file__).parent / room).glob("*.py") if "\nrouter = " in file.read_text()}
    assert written == {module.__name__.rpartition(".")[2] for module in ROOMS[room]}


@pytest.mark.parametrize("routers", [ROUTERS, CONSOLE], ids=["routes", "console"])
def test_no_route_is_answered_by_an_earlier_one(routers: tuple) -> None:
    routes = [route for router in routers for route in router.routes if isinstance(route, GuardedRoute)]
    hidden = [
        f"{route.path} by {earlier.path}"
        for place, route in enumerate(routes)
        for earlier in routes[:place]
        if earlier.methods & route.methods and earlier.path_regex.match(route.path)
    ]
    assert hidden == []
