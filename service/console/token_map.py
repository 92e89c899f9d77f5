"""The memory's tokens in a plane: each burst a point, alike ones near each other as far as two dimensions can show it.

Letters: I bursts, D token size.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from core.descriptors import unit
from core.novelty import Member
from core.views import FloatArray

WIDTH, HEIGHT, ROOM = 960, 420, 44
MOST = 2000
"""Bursts drawn; of more, evenly chosen ones."""
HUES = 10
"""Colours there are; categories beyond share them."""
LABELLED = 40
"""Categories that are named in the drawing; more names would cover it."""

LABEL_WIDTH, LABEL_HEIGHT = 60, 16
"""That a name takes up, about."""


@dataclass(frozen=True)
class Point:
    """A burst."""

    x: float
    y: float
    category_id: str
    hue: int


@dataclass(frozen=True)
class TokenMap:
    """Places are those of a drawing of WIDTH by HEIGHT."""

    width: int
    height: int
    points: tuple[Point, ...]
    labels: tuple[Point, ...]
    """One a category, in the middle of its points."""
    bursts: int
    """That there are, drawn or not."""
    explained: float
    """Share of the variance that two dimensions hold."""


def token_map(members: Sequence[Member], names: Mapping[str, str | None]) -> TokenMap:
    """The mean foreground token of each burst, along the two directions in which they vary most."""
    order = {category_id: index for index, category_id in enumerate(names)}
    living = [member for member in members if member.category_id in order]
    chosen = [living[index] for index in np.linspace(0, len(living) - 1, min(len(living), MOST)).astype(int)]
    if not chosen:
        return TokenMap(WIDTH, HEIGHT, (), (), 0, 0.0)
    places, explained = _plane(np.stack([unit(member.pooled.mean(axis=0)) for member in chosen]))
    points = [Point(x, y, member.category_id, order[member.category_id] % HUES) for (x, y), member in zip(places.round(1).tolist(), chosen)]
    groups: dict[str, list[Point]] = {}
    for point in points:
        groups.setdefault(point.category_id, []).append(point)
    labels = _labels(groups) if len(groups) <= LABELLED else []
    return TokenMap(WIDTH, HEIGHT, tuple(points), tuple(labels), len(living), explained)


def _labels(groups: Mapping[str, Sequence[Point]]) -> list[Point]:
    """Above the points of each group, from the lowest up; one that would cover another moves above it."""
    placed: list[Point] = []
    for category_id, group in sorted(groups.items(), key=lambda entry: -min(each.y for each in entry[1])):
        x, y = float(np.mean([each.x for each in group])), min(each.y for each in group) - 10
        for other in placed:
            if abs(x - other.x) < LABEL_WIDTH and abs(y - other.y) < LABEL_HEIGHT:
                y = other.y - LABEL_HEIGHT
        placed.append(Point(round(x, 1), round(y, 1), category_id, group[0].hue))
    return placed


def _plane(tokens: FloatArray) -> tuple[FloatArray, float]:
    """Places within the drawing of tokens, shape (I, D), as (I, 2), and the share of their variance that is seen there."""
    centred = (tokens - tokens.mean(axis=0)).astype(np.float64)
    variances, vectors = np.linalg.eigh(centred.T @ centred)
    axes = vectors[:, :-3:-1]
    axes = axes * np.sign(axes[np.abs(axes).argmax(axis=0), [0, 1]])
    flat = centred @ axes
    low, high = flat.min(axis=0), flat.max(axis=0)
    across, down = np.maximum(high - low, 1e-9)
    scale = min((WIDTH - 2 * ROOM) / across, (HEIGHT - 2 * ROOM) / down)
    explained = float(variances[-2:].sum() / max(float(variances.sum()), 1e-12))
    return np.asarray((flat - (low + high) / 2) * (scale, -scale) + (WIDTH / 2, HEIGHT / 2 + ROOM / 4)), explained
