"""Routes that answer with a picture."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import Query, Response

from service.pictures import Picture, at_most, encode_png
from service.schemas.problem import problems

PNG_RESPONSES: dict[int | str, dict[str, Any]] = {
    200: {"description": "A picture", "content": {"image/png": {}}},
    **problems(404, 422, 503),
}
"""The `responses` of such a route."""


Side = Annotated[int | None, Query(ge=16, le=4096, description="Most pixels of its longer side; as large as it is where left out.")]


def png(picture: Picture, side: int | None) -> Response:
    """The picture as a file."""
    return Response(encode_png(picture if side is None else at_most(picture, side)), media_type="image/png")
