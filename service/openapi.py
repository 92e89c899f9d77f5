"""The OpenAPI document: FastAPI's, with the models that routes read and answer by hand."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI
from pydantic.json_schema import models_json_schema

from service.schemas.bursts import BurstPart
from service.schemas.goals import Seen
from service.schemas.problem import Problem
from service.schemas.scans import ScanBegin

MODELS = (BurstPart, Problem, ScanBegin, Seen)


def install(app: FastAPI) -> None:
    """Completes the document that `app` serves."""
    generate = app.openapi

    def openapi() -> dict[str, Any]:
        document = generate()
        _, definitions = models_json_schema([(model, "validation") for model in MODELS], ref_template="#/components/schemas/{model}")
        document["components"]["schemas"].update(definitions["$defs"])
        return document

    app.openapi = openapi  # type: ignore[method-assign] # FastAPI's documented way to extend it
