"""What a pose estimate is: the transform, its rivals, and the correspondences it rests on.

Letters: M reference views, N target views.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from core.affine9 import Affine9
from core.boxes import OrientedBox
from core.matches import Matches
from core.sim3 import Sim3
from core.views import FloatArray


@dataclass(frozen=True, eq=False)
class Alternative:
    """Another pose that explains the views nearly as well."""

    target_from_reference: Sim3
    score: float
    confidence: float | None = None
    """As the estimate's."""


@dataclass(frozen=True, eq=False)
class PoseEstimate:
    """A target's pose and what it rests on."""

    target_from_reference: Sim3
    matches: Matches
    view_similarity: FloatArray
    """S, shape (M, N)."""
    pairs: tuple[tuple[int, int], ...]
    """(reference view, target view) pairs whose correspondences were used."""
    residual_m: float
    """Root mean square distance over the inliers, metres of the target."""
    score: float | None = None
    """How well the pose explains both objects (`core.dense`, times the agreement of view pairs), where the variant computes it."""
    confidence: float | None = None
    """Probability that the rotation is within 30° (`core.confidence`), where the variant estimates one."""
    alternatives: tuple[Alternative, ...] = ()
    target_from_object: Affine9 | None = None
    """From the frame of the reference's box, with a scale for each of its axes, where 9-D was asked for and is determined.
    `target_from_reference` is then its similarity."""
    not_9d_because: str | None = None
    """Why there is none though it was asked for."""
    stage_ms: dict[str, float] = field(default_factory=dict)

    @property
    def inliers(self) -> int:
        """Correspondences that agree with the transform."""
        return int(self.matches.inlier.sum())

    def matrix(self, reference_box: OrientedBox) -> FloatArray:
        """From the reference's world to the target's, shape (4, 4): 9-D where the pose is."""
        if self.target_from_object is None:
            return self.target_from_reference.as_matrix()
        return self.target_from_object.as_matrix() @ np.linalg.inv(reference_box.world_from_object)

    def box(self, of_reference: OrientedBox) -> OrientedBox:
        """The reference's box on the target, stretched along its axes where the pose is 9-D."""
        if self.target_from_object is None:
            return of_reference.moved_by(self.target_from_reference)
        return of_reference.stretched_by(self.target_from_object)
