"""What the service answers of the bursts in a category, as numpy and plain types."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from clients.answers import CategorySimilarity
from core.views import FloatArray


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
