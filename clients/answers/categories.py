"""Categories, the bursts in them, and how similar they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from core.views import FloatArray


@dataclass(frozen=True)
class Category:
    """A category of objects, learnt from one."""

    id: str
    name: str | None
    created_at: str
    """ISO 8601, UTC."""
    views: int
    """Views of the reference object."""
    instances: int
    """Bursts assigned to it, the reference's own included."""
    extent_m: tuple[float, ...]
    """Edge lengths of the reference's box, metres."""

    @staticmethod
    def from_json(fields: Mapping[str, Any]) -> Category:
        """From the service's answer."""
        extent_m = tuple(fields["extent_m"])
        return Category(fields["id"], fields["name"], fields["created_at"], fields["views"], fields["instances"], extent_m)


@dataclass(frozen=True)
class CategorySimilarity:
    """How similar a burst is to one category; larger is more similar."""

    category_id: str
    name: str | None
    similarity: float

    @staticmethod
    def from_json(fields: Mapping[str, Any]) -> CategorySimilarity:
        """From the service's answer."""
        return CategorySimilarity(fields["category_id"], fields["name"], fields["similarity"])


@dataclass(frozen=True)
class Instance:
    """A burst assigned to a category, and where it came from."""

    id: str
    created_at: str
    """ISO 8601, UTC."""
    source: Literal["scan", "observation"]
    source_id: str | None
    how: str
    """By the scan it was learnt from, by a decision, or because somebody said so."""
    similarity: float | None
    """To the category when it was assigned."""
    views: int
    kept: bool
    """Whether its views are still kept; else it cannot be split off."""

    @staticmethod
    def from_json(fields: Mapping[str, Any]) -> Instance:
        """From the service's answer."""
        return Instance(**{name: fields[name] for name in Instance.__dataclass_fields__})


@dataclass(frozen=True, eq=False)
class Similarities:
    """What to merge and what to split."""

    instance_ids: tuple[str, ...]
    """A category's bursts, oldest first; I of them."""
    matrix: FloatArray
    """Similarity of each pair, shape (I, I)."""
    categories: tuple[CategorySimilarity, ...]
    """The other categories, most similar first."""

    @staticmethod
    def from_json(fields: Mapping[str, Any]) -> Similarities:
        """From the service's answer."""
        others = tuple(CategorySimilarity.from_json(each) for each in fields["categories"])
        return Similarities(tuple(fields["instance_ids"]), np.array(fields["matrix"]), others)
