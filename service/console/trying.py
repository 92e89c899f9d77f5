"""/try: a burst from files at hand, and the demo episode."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

from core.errors import Unavailable
from service.auth import Caller
from service.console.demo import OBJECTS, Demo
from service.console.pages import ConsoleActorDep, Page, render
from service.deps import AgentDep, CallerDep, DemoDep, SettingsDep

router = APIRouter(prefix="/try", route_class=Page, include_in_schema=False)


@router.get("")
def trying(request: Request, agent: AgentDep, settings: SettingsDep, caller: CallerDep, episode: DemoDep) -> HTMLResponse:
    """Asks for files."""
    return render(
        request,
        "try.html",
        most_views=settings.max_views,
        may_observe=caller.may_call("observe"),
        **_told(episode, caller, bool(agent.memory.categories.all())),
    )


@router.get("/demo")
def demo(request: Request, agent: AgentDep, caller: CallerDep, episode: DemoDep) -> HTMLResponse:
    """How far the episode is."""
    return render(request, "demo.html", **_told(episode, caller, bool(agent.memory.categories.all())))


@router.post("/demo")
def demo_start(request: Request, agent: AgentDep, caller: CallerDep, actor: ConsoleActorDep, episode: DemoDep) -> HTMLResponse:
    """Begins one."""
    episode.start(agent.memory, _own_address(request), actor=actor)
    return render(request, "demo.html", **_told(episode, caller, False))


@router.post("/demo/stop")
def demo_stop(request: Request, agent: AgentDep, caller: CallerDep, episode: DemoDep) -> HTMLResponse:
    """Ends it."""
    episode.stop()
    return render(request, "demo.html", **_told(episode, caller, bool(agent.memory.categories.all())))


def _told(episode: Demo, caller: Caller, taught: bool) -> dict[str, Any]:
    may_demo = caller.may_call("console_demo_start")
    return {"demo": episode.state(), "objects": OBJECTS, "taught": taught, "may_demo": may_demo}


def _own_address(request: Request) -> str:
    """Where this process listens, whatever name or proxy the browser came by. Raises Unavailable where it does not."""
    server = request.scope.get("server")
    if server is None or server[1] is None:
        raise Unavailable(
            "the service does not listen on a port of its own, so the simulated robot cannot reach it; run `onelook simulate`"
        )
    host, port = server
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"
