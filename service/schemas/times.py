"""When, as JSON."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

CreatedAt = Annotated[str, Field(description="ISO 8601, UTC.", examples=["2026-01-31T12:00:00.000+00:00"])]
