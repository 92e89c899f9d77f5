"""The OpenAPI document: FastAPI's, with the models that routes read by hand, and what every exchange has in common."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from fastapi import FastAPI
from pydantic.json_schema import models_json_schema

from service.access import needed_role
from service.exchange import KEY, LONGEST_KEY, MemoryRoute
from service.schemas.bursts import BurstPart, Seen
from service.schemas.problem import Problem, problems
from store.keys import Role

MODELS = (BurstPart, Problem, Seen)
IF_NONE_MATCH = {
    "name": "If-None-Match",
    "in": "header",
    "required": False,
    "schema": {"type": "string"},
    "description": "The ETag of an earlier answer; 304 where nothing changed since.",
    "example": 'W/"42"',
}
IDEMPOTENCY_KEY = {
    "name": KEY,
    "in": "header",
    "required": False,
    "schema": {"type": "string", "minLength": 1, "maxLength": LONGEST_KEY},
    "description": "Made anew for each request; repeated with it, the request is not done again but answered as the first time.",
    "example": "0b5f1c1e-6a0c-4f0e-9a55-3f1f6f3f6f0d",
}
SCHEME = "key"
KEY_SCHEME = {
    "type": "http",
    "scheme": "bearer",
    "description": "A key that `onelook keys create` made. While a memory never had one, nobody is asked for it.",
}
ETAG = {"ETag": {"description": "Another one where the answer may have changed.", "schema": {"type": "string"}}}


def install(app: FastAPI, routes: list[Any]) -> None:
    """Completes the document that `app` serves; `routes` are those of its routers."""
    generate = app.openapi
    remembered = {route.name for route in routes if isinstance(route, MemoryRoute)}

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is not None:
            return app.openapi_schema
        document = generate()
        _, definitions = models_json_schema([(model, "validation") for model in MODELS], ref_template="#/components/schemas/{model}")
        document["components"]["schemas"].update(definitions["$defs"])
        document["components"]["securitySchemes"] = {SCHEME: KEY_SCHEME}
        for method, operation in _operations(document):
            if operation["operationId"] in remembered:
                _complete(method, operation)
            if (role := needed_role(operation["operationId"])) is not None:
                _secure(operation, role)
        return document

    app.openapi = openapi  # type: ignore[method-assign] # FastAPI's documented way to extend it


def _operations(document: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    for methods in document["paths"].values():
        yield from methods.items()


def _secure(operation: dict[str, Any], role: Role) -> None:
    """Adds what `GuardedRoute` does to every operation that takes a role."""
    operation["security"] = [{SCHEME: []}]
    operation["x-role"] = role
    operation["description"] = f"{operation['description']}\n\nRole: {role}."
    for status, response in problems(401, 403, 429).items():
        operation["responses"].setdefault(str(status), response)


def _complete(method: str, operation: dict[str, Any]) -> None:
    """Adds what `MemoryRoute` does to every operation."""
    parameters, responses = operation.setdefault("parameters", []), operation["responses"]
    if method == "get":
        parameters.append(IF_NONE_MATCH)
        responses["304"] = {"description": "Nothing changed", "headers": ETAG}
        responses["200"]["headers"] = ETAG
    if method == "post":
        parameters.append(IDEMPOTENCY_KEY)
        for status, response in problems(409, 422, 503).items():
            responses.setdefault(str(status), response)
