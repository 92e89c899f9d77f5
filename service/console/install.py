"""Puts the console into the application."""

from __future__ import annotations

from fastapi import FastAPI

from service.console import categories, change, memory, now, observations, sign_in, trying
from service.console.assets import PREFIX, Assets
from service.guarded import include

PAGES = (now, categories, change, observations, memory, trying, sign_in)
ROUTERS = (*(page.router for page in PAGES), categories.pictures)


def install(app: FastAPI) -> None:
    """Its pages, and the files they need."""
    include(app, ROUTERS)
    app.mount(PREFIX, Assets(), name="static")
