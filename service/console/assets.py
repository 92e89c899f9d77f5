"""Styles and scripts, served from this folder and nowhere else; labs have no internet."""

from __future__ import annotations

import hashlib
import mimetypes
from functools import cache
from pathlib import Path

from starlette.responses import Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

FOLDER = Path(__file__).parent / "static"
PREFIX = "/static"
FOREVER = "public, max-age=31536000, immutable"
"""Of an address that names its content; others are asked for again, and answered 304 where nothing changed."""

mimetypes.add_type("text/javascript", ".js")  # whatever the machine's own table says: a module of another type is refused


@cache
def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:12]


def asset_url(name: str) -> str:
    """The address of a file below static/, which changes with its content."""
    return f"{PREFIX}/{name}?v={_digest(FOLDER / name)}"


class Assets(StaticFiles):
    """The folder, with how long each answer keeps."""

    def __init__(self) -> None:
        super().__init__(directory=FOLDER)

    async def get_response(self, path: str, scope: Scope) -> Response:
        """Starlette's."""
        response = await super().get_response(path, scope)
        named = scope["query_string"].startswith(b"v=")
        response.headers["Cache-Control"] = FOREVER if named else "no-cache"
        return response
