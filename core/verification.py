"""Verification by pose: does a category's reference explain a burst?

The tokens say which categories to ask; the best pose of each then lays its reference on the burst. Two objects of a kind agree over most
of their surface, in shape and appearance at once; two of different kinds can be laid on each other but do not agree.
"""

from __future__ import annotations

from core.backbones.whitening import Whitening
from core.dense import DenseAgreement, DenseConfig
from core.descriptors import unit
from core.encode import EncodedBurst
from core.estimators.batched import Sim3Batch
from core.evidence import whitened
from core.pose import PoseConfig, PoseEstimator
from core.pose_estimate import PoseEstimate
from core.reference import Reference
from core.sim3 import Sim3
from core.surface import Surface

DENSE = DenseConfig(points=700, sigma=0.1)
"""Wider than for ranking poses: objects of a kind differ in shape."""
VERIFYING = PoseConfig.named("best")
"""The poses that verify, whatever variant an answer's pose is of: the shipped figures are of these."""


def verify(reference: Reference, target: EncodedBurst, whitening: Whitening | None, *, seed: int = 0) -> tuple[PoseEstimate, float]:
    """The best pose of a reference on a burst, and their `agreement` there. Raises as `PoseEstimator.estimate` does."""
    estimate = PoseEstimator(VERIFYING).estimate(reference, target, seed=seed)
    return estimate, agreement(reference, target, estimate.target_from_reference, whitening)


def agreement(reference: Reference, target: EncodedBurst, target_from_reference: Sim3, whitening: Whitening | None) -> float:
    """How well a pose lays the reference on the burst, in [0, 1], by whole whitened tokens and measured points.

    Whitened, since the reference's own components, which serve to find the pose, tell parts of its kind apart and not kinds.
    """
    sides = [[view.trusted_only() for view in views] for views in (reference.views, target.views)]
    described = [[unit(whitened(view.descriptors, whitening)) for view in views] for views in sides]
    dense = DenseAgreement(Surface(sides[0]), Surface(sides[1]), (described[0], described[1]), DENSE, seed=0)
    return float(dense.score(Sim3Batch.of([target_from_reference]))[0])
