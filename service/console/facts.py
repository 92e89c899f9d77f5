"""What a category's page says in words and bars. Letters: S rotations, C components."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from core.reference import Reference
from core.symmetry import CONTINUOUS
from core.views import FloatArray
from service.console.words import quantity
from store.overview import Summary

FEW_VIEWS = 6
"""A reference of fewer leaves sides unseen."""
MANY_WITHOUT_POSE = 0.3
ENOUGH_SEEN = 3
"""Recognitions that say something of poses."""
SAME_AXIS = 0.966
"""Cosine of 15°: axes that near are one, as the search for symmetries goes by the box's axes."""
SHOWN = 32
"""Components in the chart: as many as descriptors are reduced to."""
AXES = "xyz"

Level = Literal["good", "new", "poor"]


@dataclass(frozen=True)
class Health:
    """How well a category does."""

    level: Level
    word: str
    why: str


def health(category: Summary) -> Health:
    """From what was seen of it."""
    if category.recognised >= ENOUGH_SEEN and category.without_pose >= MANY_WITHOUT_POSE * category.recognised:
        why = f"{category.without_pose} of {category.recognised} recognised objects got no pose: scan it again, or split it"
        return Health("poor", "poses fail", why)
    if category.views < FEW_VIEWS:
        return Health("poor", "few views", f"its reference has {category.views} views: sides that none shows cannot be matched")
    if category.instances == 1 and not category.recognised:
        return Health("new", "seen once", "nothing but the object that it was learnt from was taken for it so far")
    poses = category.recognised - category.without_pose
    return Health("good", "good", f"{quantity(category.instances, 'burst')}, and {quantity(poses, 'pose')} among those kept")


def symmetry_words(reference: Reference) -> list[str]:
    """A sentence for each axis about which the object looks the same."""
    turns = Rotation.from_matrix(reference.symmetries).as_rotvec() if len(reference.symmetries) else np.empty((0, 3))
    axes: list[tuple[FloatArray, int]] = []
    for turn in turns:
        axis = turn / np.linalg.norm(turn)
        index = next((place for place, (known, _) in enumerate(axes) if abs(known @ axis) > SAME_AXIS), None)
        if index is None:
            axes.append((axis, 1))
        else:
            axes[index] = (axes[index][0], axes[index][1] + 1)
    return [f"{_turns(count + 1)} about {_axis(reference, axis)}" for axis, count in sorted(axes, key=lambda each: -each[1])]


def _turns(order: int) -> str:
    if order >= CONTINUOUS:
        return "any turn"
    return "a half turn" if order == 2 else f"turns of {360 / order:.0f}°"


def _axis(reference: Reference, axis: FloatArray) -> str:
    along = np.abs(axis @ reference.box.world_from_object[:3, :3])
    return f"its {AXES[along.argmax()]} axis" if along.max() > SAME_AXIS else "an axis askew to its box"


@dataclass(frozen=True)
class Bar:
    """Of a chart whose longest bar is 1."""

    length: float
    share: float
    cumulative: float


def variance_bars(explained: Sequence[float] | FloatArray) -> list[Bar]:
    """One a component, largest first, shape (C,)."""
    shares = np.asarray(explained, dtype=float)[:SHOWN]
    most = max(float(shares.max(initial=0)), 1e-12)
    return [Bar(share / most, share, total) for share, total in zip(shares.tolist(), np.cumsum(shares).tolist())]
