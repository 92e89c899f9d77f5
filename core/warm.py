"""A pose from the last one: where an object was a moment ago it very nearly is, so nothing need be sought, only laid on again and checked.

The last pose is refined against the reference views that look from where the target views look now, and scored there. A full solve
(`core.pose`) is needed for the first pose, and again as soon as the score falls: the object was moved, or what is seen is no longer it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from core.dense import DenseAgreement, DenseConfig
from core.encode import EncodedBurst
from core.estimators.batched import Sim3Batch
from core.matched_pair import describe, require_comparable
from core.reference import Reference
from core.sim3 import Sim3, rotation_angle_deg
from core.surface import Surface
from core.viewpoints import relative_rotations


@dataclass(frozen=True)
class WarmConfig:
    """How much is looked at, and when it is not believed."""

    nearest: int = 2
    """Reference views for each target view: those that look from nearest where it looks, by the last pose."""
    keep: float = 0.75
    """Of the score of the last full solve; with less it is sought anew. Scores of right poses vary by a tenth from frame to frame."""
    most_turn_deg: float = 30.0
    """Refinement turns a pose by less than this towards the right one; a larger turn is another pose, not the same one moved on."""
    most_resize: float = 1.3
    """Factor by which it may change the scale, for the same reason."""
    sought_anew_after: int = 15
    """Frames for which an object is followed from its last pose: a pose that was wrong from the start must not stay."""
    dims: int = 32
    dense: DenseConfig = field(default_factory=lambda: DenseConfig(points=300))


@dataclass(frozen=True, eq=False)
class Settled:
    """A pose that later ones may start from."""

    pose: Sim3
    """target_from_reference."""
    score: float
    """Of the full solve that began it, as `settle` scores."""


def settle(reference: Reference, target: EncodedBurst, pose: Sim3, config: WarmConfig, seed: int) -> Settled | None:
    """What a full solve found, ready to be followed; None where too little was seen to score it."""
    agreement = _agreement(reference, target, pose, config, seed)
    return None if agreement is None else Settled(pose, float(agreement.score(Sim3Batch.of([pose]))[0]))


def follow(reference: Reference, target: EncodedBurst, before: Settled, config: WarmConfig, seed: int) -> Settled | None:
    """The pose on a later burst of the same object; None where it must be sought anew. Raises InvalidInput as a full solve does."""
    require_comparable(reference, target)
    agreement = _agreement(reference, target, before.pose, config, seed)
    if agreement is None:
        return None
    found = agreement.refine(Sim3Batch.of([before.pose]))
    pose = found[0]
    turned = float(rotation_angle_deg(pose.rotation, before.pose.rotation))
    resized = abs(float(np.log(pose.scale / before.pose.scale)))
    if turned > config.most_turn_deg or resized > np.log(config.most_resize):
        return None
    score = float(agreement.score(found)[0])
    return Settled(pose, before.score) if score >= config.keep * before.score else None


def nearest_views(reference: Reference, target: EncodedBurst, pose: Sim3, count: int) -> list[int]:
    """The reference views that, by a pose, look at the object from nearest where each target view looks, `count` for each, in order."""
    relative = relative_rotations(reference.views, target.views)
    off_deg = rotation_angle_deg(relative, pose.rotation)
    return sorted({int(view) for ranked in np.argsort(off_deg, axis=0)[:count].T for view in ranked})


def _agreement(reference: Reference, target: EncodedBurst, pose: Sim3, config: WarmConfig, seed: int) -> DenseAgreement | None:
    near = nearest_views(reference, target, pose, config.nearest)
    sides = [
        [view.trusted_only() for view in views if view.trusted.any()] for views in ([reference.views[each] for each in near], target.views)
    ]
    if not all(sides):
        return None
    descriptors = describe(sides[0], reference, config.dims), describe(sides[1], reference, config.dims)
    return DenseAgreement(Surface(sides[0]), Surface(sides[1]), descriptors, config.dense, seed)
