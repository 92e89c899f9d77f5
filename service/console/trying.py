"""/try: a burst from files at hand, and the demo episode."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

from core.errors import Unavailable
from service.access import ACCESS
from service.auth import Caller
from service.console.demo import OBJECTS, Demo
from service.console.pages import Page, render
from service.deps import AgentDep
from service.settings import Settings

router = APIRouter(prefix="/try", route_class=Page, include_in_schema=False)


@router.get("")
def trying(request: Request, agent: AgentDep) -> HTMLResponse:
    """Asks for files."""
    settings: Settings = request.app.state.settings
    caller: Caller = request.state.caller
    return render(
        request,
        "try.html",
        most_views=settings.max_views,
        may_observe=caller.may(ACCESS["observe"] or "viewer"),
        **_demo(request, bool(agent.memory.categories.all())),
    )


@router.get("/demo")
def demo(request: Request, agent: AgentDep) -> HTMLResponse:
    """How far the episode is."""
    return render(request, "demo.html", **_demo(request, bool(agent.memory.categories.all())))


@router.post("/demo")
def demo_start(request: Request, agent: AgentDep) -> HTMLResponse:
    """Begins one."""
    caller: Caller = request.state.caller
    _of(request).start(agent.memory, _own_address(request), actor=caller.as_actor("console"))
    return render(request, "demo.html", **_demo(request, False))


@router.post("/demo/stop")
def demo_stop(request: Request, agent: AgentDep) -> HTMLResponse:
    """Ends it."""
    _of(request).stop()
    return render(request, "demo.html", **_demo(request, bool(agent.memory.categories.all())))


def _of(request: Request) -> Demo:
    demo: Demo = request.app.state.demo
    return demo


def _demo(request: Request, taught: bool) -> dict[str, Any]:
    caller: Caller = request.state.caller
    return {"demo": _of(request).state(), "objects": OBJECTS, "taught": taught, "may_demo": caller.may("admin")}


def _own_address(request: Request) -> str:
    """Where this process listens, whatever name or proxy the browser came by. Raises Unavailable where it does not."""
    server = request.scope.get("server")
    if server is None or server[1] is None:
        raise Unavailable(
            "the service does not listen on a port of its own, so the simulated robot cannot reach it; run `onelook simulate`"
        )
    host, port = server
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"
