"""The one place where errors become HTTP: every one is answered as RFC 9457 problem details."""

from __future__ import annotations

import errno
import logging
from collections.abc import Sequence
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException

from core import errors as core
from service.limits import media_type
from service.logs import HEADER, request_id
from service.refusals import Busy, NoKey, NotAllowed, TooOften
from service.schemas.problem import MEDIA_TYPE, FieldError, Problem
from store.requests import StillRunning

log = logging.getLogger("onelook")
KINDS: tuple[tuple[type[core.OneLookError], int, str, str], ...] = (
    (core.TooFewViews, 422, "too-few-views", "More views are needed"),
    (core.NoObject, 422, "no-object", "No object stands out from the background"),
    (core.InvalidInput, 422, "invalid-input", "A field of the request is wrong"),
    (core.NoPose, 422, "no-pose", "No pose explains the views"),
    (core.NotFound, 404, "not-found", "There is no such thing"),
    (core.Conflict, 409, "conflict", "Its state does not allow this"),
    (core.Unavailable, 503, "unavailable", "Something the service needs is missing or busy"),
    (NoKey, 401, "no-key", "A key is missing, or not valid"),
    (NotAllowed, 403, "not-allowed", "This takes another role"),
    (TooOften, 429, "too-often", "The key was used too often"),
)
"""The first kind that an error is an instance of says its status, type and title."""

MACHINE = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EROFS, errno.ENOMEM, errno.EMFILE, errno.ENFILE})
"""What the operating system refuses though the request is in order."""

STILL_RUNNING_S = 1
"""After which a request is worth repeating whose first one is still being answered."""


def install(app: FastAPI) -> None:
    """Makes `app` answer every error as a problem."""
    app.add_exception_handler(core.OneLookError, _on_onelook_error)
    app.add_exception_handler(RequestValidationError, _on_validation_error)
    app.add_exception_handler(HTTPException, _on_http_exception)
    app.add_exception_handler(MemoryError, _on_out_of_memory)
    app.add_exception_handler(OSError, _on_os_error)
    app.add_exception_handler(Exception, _on_unexpected)


def problem_of(error: core.OneLookError) -> Problem:
    """The problem that tells of `error`."""
    field = error.field if isinstance(error, core.InvalidInput) else None
    for kind, status, name, title in KINDS:
        if isinstance(error, kind):
            return Problem(type=f"urn:onelook:problem:{name}", title=title, status=status, detail=str(error), field=field)
    return _unexpected()


def _on_onelook_error(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, core.OneLookError)
    if isinstance(error, core.Unavailable) and not isinstance(error, Busy):
        log.warning(str(error))
    return problem_answer(error)


def problem_answer(error: core.OneLookError) -> JSONResponse:
    """The answer that tells of `error`."""
    return _json(problem_of(error), _headers(error))


def _headers(error: core.OneLookError) -> dict[str, str]:
    if isinstance(error, (Busy, TooOften)):
        return {"Retry-After": str(error.retry_after_s)}
    if isinstance(error, StillRunning):
        return {"Retry-After": str(STILL_RUNNING_S)}
    return {"WWW-Authenticate": 'Bearer realm="onelook"'} if isinstance(error, NoKey) else {}


def _on_validation_error(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    return _json(validation_problem(error.errors()))


def validation_problem(found: Sequence[Any]) -> Problem:
    """The problem of pydantic's list of errors; the first one is the detail."""
    errors = [_field_error(each) for each in found]
    first = errors[0]
    return Problem(
        type="urn:onelook:problem:invalid-input",
        title="A field of the request is wrong",
        status=422,
        detail=f"{first.field}: {first.detail}",
        field=first.field,
        errors=errors if len(errors) > 1 else None,
    )


def _field_error(error: Any) -> FieldError:
    if error["type"] == "json_invalid":
        return FieldError(field="body", detail=f"is not JSON ({error['ctx']['error']})")
    return FieldError(field=field_path(error["loc"]), detail=error["msg"].removeprefix("Value error, "))


def field_path(location: Sequence[int | str]) -> str:
    """('body', 'views', 3, 'K') as `views[3].K`."""
    names = [part for part in location if part not in {"body", "query", "path"}] or list(location)
    path = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in names)
    return path.removeprefix(".") or "body"


def _on_http_exception(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    if error.status_code == 400:  # what FastAPI says of a body that it cannot read
        json = "is no JSON that can be read: it is not UTF-8 text, too deeply nested, or has numbers that are too long"
        why = f"is no form that can be read: {error.detail}" if "form" in media_type(request.headers) else json
        return _json(problem_of(core.InvalidInput("body", why)))
    title = HTTPStatus(error.status_code).phrase
    detail = str(error.detail)
    if error.status_code == 404 and detail == title:
        detail = f"nothing is at {request.url.path}; /docs lists what there is"
    elif error.status_code == 405 and detail == title:
        detail = f"{request.url.path} does not answer {request.method}; /docs lists what it answers"
    return _json(Problem(type="about:blank", title=title, status=error.status_code, detail=detail), error.headers)


def _on_out_of_memory(request: Request, error: Exception) -> JSONResponse:
    return _on_onelook_error(
        request,
        core.Unavailable("the service is out of memory; send fewer or smaller views, or lower ONELOOK_WORKERS, _QUEUE or _MAX_MEGAPIXELS"),
    )


def _on_os_error(request: Request, error: Exception) -> JSONResponse:
    """Of temporary files, mostly: what concerns the memory is told by the store."""
    assert isinstance(error, OSError)
    if error.errno not in MACHINE:
        raise error
    where = f" ({error.filename})" if error.filename else ""
    return _on_onelook_error(
        request, core.Unavailable(f"this machine cannot: {error.strerror}{where}; free it, then send the request again")
    )


def _on_unexpected(request: Request, error: Exception) -> JSONResponse:
    # Answered outside the middleware that names the others.
    return _json(_unexpected(), {HEADER: request_id.get() or ""})


def _unexpected() -> Problem:
    detail = "the service failed in a way it did not expect; its log says where, please report it"
    return Problem(type="urn:onelook:problem:unexpected", title="Internal Server Error", status=500, detail=detail)


def _json(problem: Problem, headers: Any = None) -> JSONResponse:
    return JSONResponse(problem.model_dump(exclude_none=True), problem.status, headers=headers, media_type=MEDIA_TYPE)
