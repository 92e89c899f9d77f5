"""Categories as JSON."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from service.schemas.geometry import Vector3
from store import records

Name = Field(None, min_length=1, max_length=200, description="What people call it; null where nobody said.", examples=["cup"])


class Category(BaseModel):
    """A category of objects, learnt from one."""

    id: str = Field(description="Never reused.", examples=["4be0643f1d98573b97cdca98a65347dd"])
    name: str | None = Name
    created_at: str = Field(description="ISO 8601, UTC.", examples=["2026-01-31T12:00:00.000+00:00"])
    views: int = Field(description="Views of the reference object.", examples=[10])
    instances: int = Field(description="Bursts assigned to the category, the reference's own included.", examples=[1])
    extent_m: Vector3 = Field(description="Edge lengths of the reference's oriented box, metres.", examples=[[0.09, 0.12, 0.1]])

    @staticmethod
    def of(category: records.Category) -> Category:
        """From the memory's record."""
        return Category(
            id=category.id,
            name=category.name,
            created_at=category.created_at,
            views=category.views,
            instances=category.instances,
            extent_m=list(category.extent_m),
        )


class CategoryList(BaseModel):
    """All categories, oldest first."""

    categories: list[Category]


class CategoryPatch(BaseModel):
    """What may be changed."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"example": {"name": "cup"}})

    name: str | None = Name
