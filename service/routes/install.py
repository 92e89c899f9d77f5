"""Puts the endpoints into the application."""

from __future__ import annotations

from fastapi import FastAPI

from service import openapi
from service.guarded import include
from service.routes import categories, events, goals, health, memory, observations, scans, track
from service.state import Made

ENDPOINTS = (observations, scans, categories, goals, memory, events, track, health)
ROUTERS = (*(each.router for each in ENDPOINTS), memory.live)
MADE: Made = {path: made for each in ENDPOINTS for path, made in getattr(each, "MADE", {}).items()}
"""Of all of them: what a repeated request is answered with where its first answer was lost."""


def install(app: FastAPI) -> None:
    """All of them, and their document."""
    include(app, ROUTERS)
    openapi.install(app, [route for router in ROUTERS for route in router.routes])
