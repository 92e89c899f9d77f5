"""Fields that stand in more than one model, each worded once."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from store.records import LONGEST_NAME

CreatedAt = Annotated[str, Field(description="ISO 8601, UTC.", examples=["2026-01-31T12:00:00.000+00:00"])]
Name = Field(None, min_length=1, max_length=LONGEST_NAME, description="What people call it; null where nobody said.", examples=["cup"])
"""Of a category."""
Score = Annotated[str, Field(description="How similar two bursts are, for the decision.")]
Threshold = Annotated[float | None, Field(description="Least similarity of a known object; null where the score or the rate decides.")]
FalseKnownRate = Annotated[
    float, Field(description="Of objects of no known category, the share that may be called known.", examples=[0.01])
]
