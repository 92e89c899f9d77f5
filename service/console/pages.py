"""What every page has in common: its frame, what a browser may load for it, and errors that a person can read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any
from urllib.parse import urlencode

from anyio.to_thread import run_sync
from fastapi import Depends, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.responses import HTMLResponse, RedirectResponse
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from core.calibration import LARGEST_RATE
from core.errors import OneLookError
from service.auth import Caller
from service.console.assets import asset_url
from service.console.words import FILTERS
from service.deps import CallerDep
from service.errors import problem_of, validation_problem
from service.guarded import Answering, GuardedRoute
from service.refusals import NoKey
from service.schemas.problem import Problem
from service.settings import SMALLEST_RATE
from store.records import LONGEST_NAME

TEMPLATES = Path(__file__).parent / "templates"
HEADERS = {
    # Everything comes from this service: no inline script or style, nothing evaluated, nothing from elsewhere. Previews of files that
    # were dropped into a page are blob:.
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; "
    "form-action 'self'; base-uri 'none'; frame-ancestors 'none'",
    "Cache-Control": "private, no-cache",
}


def _at_the_console(caller: CallerDep) -> str | None:
    return caller.as_actor("console")


ConsoleActorDep = Annotated[str | None, Depends(_at_the_console)]
"""Who changes something on a page, for the audit trail: browsers send no X-Actor."""


@dataclass(frozen=True)
class Link:
    """An entry of the navigation."""

    path: str
    title: str


NAVIGATION = (
    Link("/", "Now"),
    Link("/categories", "Categories"),
    Link("/observations", "Observations"),
    Link("/memory", "Memory"),
    Link("/try", "Try it"),
)


def query(**parameters: str | int | None) -> str:
    """The end of an address, with those that are given."""
    given = {name: value for name, value in parameters.items() if value is not None}
    return f"?{urlencode(given)}" if given else ""


def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(TEMPLATES), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.globals.update(
        navigation=NAVIGATION,
        asset=asset_url,
        query=query,
        longest_name=LONGEST_NAME,
        smallest_rate=SMALLEST_RATE,
        largest_rate=LARGEST_RATE,
    )
    environment.filters.update(FILTERS)
    return environment


ENVIRONMENT = _environment()


def render(request: Request, template: str, status: int = 200, **context: Any) -> HTMLResponse:
    """A page, or the part of one that htmx asked for."""
    path = request.url.path
    here = next((link.path for link in NAVIGATION if link.path != "/" and path.startswith(link.path)), "/" if path == "/" else None)
    caller: Caller | None = getattr(request.state, "caller", None)
    return HTMLResponse(ENVIRONMENT.get_template(template).render(request=request, here=here, caller=caller, **context), status)


class Page(GuardedRoute):
    """A route that answers a person's browser: an error becomes a page, or a note within one where htmx asked."""

    kind = "console_"

    def get_route_handler(self) -> Answering:
        """The guarded one, with that around it."""
        answer = super().get_route_handler()

        async def page(request: Request) -> Response:
            try:
                response = await answer(request)
            except NoKey:
                response = _to_sign_in(request)
            except OneLookError as error:
                response = await run_sync(_problem, request, problem_of(error))
            except RequestValidationError as error:
                response = await run_sync(_problem, request, validation_problem(error.errors()))
            for name, value in HEADERS.items():
                response.headers.setdefault(name, value)
            return response

        return page


def _to_sign_in(request: Request) -> Response:
    """And from there back; to the first page from what is no page, or a part of one."""
    part = "hx-request" in request.headers
    path = request.url.path if request.method == "GET" and not part else "/"
    address = "/sign-in" + query(next=f"{path}?{request.url.query}" if request.url.query and path != "/" else path)
    return Response(status_code=401, headers={"HX-Redirect": address}) if part else RedirectResponse(address, 303)


def _problem(request: Request, problem: Problem) -> Response:
    template = "problem_note.html" if "hx-request" in request.headers else "problem.html"
    return render(request, template, problem.status, problem=problem)
