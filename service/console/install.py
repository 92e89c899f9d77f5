"""Puts the console into the application."""

from __future__ import annotations

from fastapi import FastAPI

from service.console import categories, change, memory, now, observations, sign_in, trying
from service.console.assets import PREFIX, Assets


def install(app: FastAPI) -> None:
    """Its pages, and the files they need."""
    for page in (now, categories, change, observations, memory, trying, sign_in):
        app.include_router(page.router)
    app.include_router(categories.pictures)
    app.mount(PREFIX, Assets(), name="static")
