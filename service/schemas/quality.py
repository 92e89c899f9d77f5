"""What is wrong with views, and how much an answer rests on, as JSON."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import BaseModel, Field

from core import grounds, quality


class Fault(BaseModel):
    """What is wrong with one view; it is used all the same."""

    kind: quality.FaultKind
    detail: str = Field(description="What was found and what would be better.")

    @staticmethod
    def of(faults: Sequence[quality.ViewFault]) -> list[Fault]:
        """Of one view."""
        return [Fault(kind=fault.kind, detail=fault.detail) for fault in faults]


class Grounds(BaseModel):
    """How much an answer rests on."""

    views: int = Field(examples=[5])
    shown: int = Field(description="Views in which the object was found.", examples=[5])
    with_depth: int = Field(description="Of these, how many have depth on it.", examples=[5])
    spread_deg: float | None = Field(
        description="Largest angle about the object between two views; null without cameras and depth.", examples=[95.0]
    )
    weakness: str | None = Field(description="Why the answer rests on little, such as one view only; null where it does not.")
    faults: list[list[Fault]] = Field(description="What is wrong with each view.")

    @staticmethod
    def of(found: grounds.Grounds) -> Grounds:
        """From core's type."""
        return Grounds(
            views=found.views,
            shown=found.shown,
            with_depth=found.with_depth,
            spread_deg=found.spread_deg,
            weakness=found.weakness,
            faults=[Fault.of(view) for view in found.faults],
        )
