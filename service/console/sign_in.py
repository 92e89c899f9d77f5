"""/sign-in and /sign-out: a person's key becomes a session of their browser."""

from __future__ import annotations

from datetime import timedelta
from typing import Annotated

from fastapi import APIRouter, Form, Query, Request
from fastapi.responses import RedirectResponse, Response

from service.auth import COOKIE
from service.console.pages import Page, render
from service.deps import AgentDep, SettingsDep

router = APIRouter(route_class=Page, include_in_schema=False)
LONGEST_KEY = 500
LONGEST_ADDRESS = 2000

Next = Annotated[str, Query(max_length=LONGEST_ADDRESS)]


@router.get("/sign-in")
def sign_in(request: Request, agent: AgentDep, next: Next = "/") -> Response:
    """Asks for a key, where the service does."""
    if not agent.memory.keys.required():
        return RedirectResponse("/", 303)
    return render(request, "sign_in.html", next=own_address(next), wrong=False, longest_key=LONGEST_KEY)


@router.post("/sign-in")
def begin_session(
    request: Request,
    agent: AgentDep,
    settings: SettingsDep,
    key: Annotated[str, Form(max_length=LONGEST_KEY)],
    next: Annotated[str, Form(max_length=LONGEST_ADDRESS)] = "/",
) -> Response:
    """Goes on to where the person was going."""
    found = agent.memory.keys.find(key.strip())
    if found is None:
        return render(request, "sign_in.html", 401, next=own_address(next), wrong=True, longest_key=LONGEST_KEY)
    span = timedelta(hours=settings.session_h)
    answer = RedirectResponse(own_address(next), 303)
    token = agent.memory.sessions.begin(found, span)
    secure = request.url.scheme == "https"
    answer.set_cookie(COOKIE, token, max_age=int(span.total_seconds()), httponly=True, samesite="strict", secure=secure)
    return answer


@router.post("/sign-out")
def end_session(request: Request, agent: AgentDep) -> Response:
    """Forgets the session, here and in the browser."""
    if (token := request.cookies.get(COOKIE)) is not None:
        agent.memory.sessions.end(token)
    answer = RedirectResponse("/sign-in", 303)
    answer.delete_cookie(COOKIE, httponly=True, samesite="strict")
    return answer


def own_address(address: str) -> str:
    """An address below this service; its first page in place of any other, so that no link to the sign-in leads away from here."""
    own = address.startswith("/") and not address.startswith("//") and "\\" not in address and address.isprintable()
    return address if own else "/"
