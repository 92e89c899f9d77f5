"""Categories as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from core.scores import SCORES
from service.curation import Similarities
from service.schemas.fields import CreatedAt, Name
from service.schemas.geometry import Vector3
from store import records


class Category(BaseModel):
    """A category of objects, learnt from one."""

    id: str = Field(description="Never reused.", examples=["4be0643f1d98573b97cdca98a65347dd"])
    name: str | None = Name
    created_at: CreatedAt
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


class CategoryMerge(BaseModel):
    """Which category joins this one."""

    model_config = ConfigDict(
        extra="forbid", populate_by_name=True, json_schema_extra={"example": {"from": "4be0643f1d98573b97cdca98a65347dd"}}
    )

    source: str = Field(alias="from", description="Its bursts join this category; its reference, name and goals go.")


class CategorySplit(BaseModel):
    """Which bursts leave for a new category."""

    model_config = ConfigDict(
        extra="forbid", json_schema_extra={"example": {"instance_ids": ["7d0a64b9a4f3a2c7e7f57d6cb1f0f6de"], "name": "mug"}}
    )

    instance_ids: list[str] = Field(
        min_length=1, max_length=1000, description="Instances of this category; the first whose kept views allow it becomes the reference."
    )
    name: str | None = Name


class Instance(BaseModel):
    """A burst assigned to a category, and where it came from."""

    id: str = Field(examples=["7d0a64b9a4f3a2c7e7f57d6cb1f0f6de"])
    created_at: CreatedAt
    source: Literal["scan", "observation"]
    source_id: str | None = Field(description="Of that scan or observation, which may be gone since.")
    how: records.Assignment = Field(
        description="How it came to the category: by the scan it was learnt from, by a decision, or because a caller or a person said so."
    )
    similarity: float | None = Field(description="To the category when it was assigned; null where nobody asked.", examples=[0.62])
    views: int = Field(examples=[5])
    kept: bool = Field(description="Whether its views are still kept; where not, it is recognised by all the same but cannot be split off.")

    @staticmethod
    def of(instance: records.Instance) -> Instance:
        """From the memory's record."""
        names = ("id", "created_at", "source", "source_id", "how", "similarity", "views", "kept")
        return Instance(**{name: getattr(instance, name) for name in names})


class InstanceList(BaseModel):
    """The bursts of a category, oldest first."""

    instances: list[Instance]


class OtherCategory(BaseModel):
    """How similar another category is."""

    category_id: str
    name: str | None
    similarity: float = Field(description="Of the two most similar bursts, in the unit of the score.", examples=[0.31])


class CategorySimilarities(BaseModel):
    """How like each other a category's bursts are, and how like it the other categories: what to merge and what to split."""

    score: str = Field(description="By which it is told.", examples=["pooled_best_view"])
    threshold: float = Field(description="Usual least similarity of bursts of one category, by that score.")
    instance_ids: list[str] = Field(description="Oldest first.")
    matrix: list[list[float]] = Field(description="Similarity of each pair of instances, in their order.")
    categories: list[OtherCategory] = Field(description="The others, most similar first.")

    @staticmethod
    def of(found: Similarities, names: Mapping[str, str | None]) -> CategorySimilarities:
        """From the agent's answer; `names` are the categories' by id."""
        return CategorySimilarities(
            score=found.score,
            threshold=SCORES[found.score].threshold,
            instance_ids=[instance.id for instance in found.instances],
            matrix=found.matrix.tolist(),
            categories=[OtherCategory(category_id=each, name=names.get(each), similarity=value) for each, value in found.categories],
        )
