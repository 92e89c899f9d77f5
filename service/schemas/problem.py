"""Errors as RFC 9457 problem details."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

MEDIA_TYPE = "application/problem+json"


class FieldError(BaseModel):
    """One of several fields that are wrong."""

    field: str = Field(description="Path of the field.")
    detail: str = Field(description="What was found and what was expected.")


class Problem(BaseModel):
    """What went wrong, and what to do about it."""

    model_config = ConfigDict(
        json_schema_extra={
            "example": {
                "type": "urn:onelook:problem:invalid-input",
                "title": "A field of the request is wrong",
                "status": 422,
                "detail": "views[3].depth: its median is 812 m: millimetres sent as metres? Set depth_scale to 0.001",
                "field": "views[3].depth",
            }
        }
    )

    type: str = Field(description="What kind of problem, as a URN that does not change.")
    title: str = Field(description="The kind in words.")
    status: int = Field(description="The HTTP status.")
    detail: str = Field(description="This problem in one sentence that a person can act on.")
    field: str | None = Field(None, description="The field of the request that is wrong, where it is one.")
    errors: list[FieldError] | None = Field(None, description="Every wrong field, where there are several.")


def problems(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """The `responses` of a route that may answer these statuses with a problem."""
    content = {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}}
    return {status: {"description": DESCRIPTIONS[status], "content": content} for status in statuses}


DESCRIPTIONS = {
    401: "A key is missing, or not valid",
    403: "The key's role does not allow this",
    404: "There is no such thing",
    409: "Its state does not allow this",
    413: "The body is too large",
    415: "The body is of another media type",
    422: "A field of the request is wrong",
    429: "The key was used too often",
    503: "Something the service needs is missing or busy",
}
