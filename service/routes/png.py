"""Routes that answer with a picture."""

from __future__ import annotations

from typing import Any

from fastapi import Response

from service.pictures import Picture, encode_png
from service.schemas.problem import problems

PNG_RESPONSES: dict[int | str, dict[str, Any]] = {200: {"description": "A picture", "content": {"image/png": {}}}, **problems(404, 422)}
"""The `responses` of such a route."""


def png(picture: Picture) -> Response:
    """The picture as a file."""
    return Response(encode_png(picture), media_type="image/png")
