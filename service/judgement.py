"""What a burst shows: the decision, with the poses that verified it and, where it is uncertain, where to look next."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from core.backbones.whitening import Whitening
from core.encode import EncodedBurst
from core.errors import InvalidInput, NoObject, NoPose, Unavailable
from core.next_view import Candidate, next_viewpoints
from core.novelty import Context, Decision, DecisionConfig, decide
from core.pose_estimate import PoseEstimate
from core.reference import Reference
from core.scores import BEST
from service.cancelling import require_wanted
from service.compute import CategoryReference, Solves
from store.memory import Memory

CALIBRATED_BY = 300
"""Latest decisions that the threshold is made of; objects and places of long ago need not be today's."""


@dataclass(frozen=True, eq=False)
class Judgement:
    """See module."""

    decision: Decision
    viewpoints: NDArray[np.floating] | None
    """Of an uncertain object, shape (n, 4, 4); None without depth and cameras."""


@dataclass(eq=False)
class Judge:
    """Judges one burst."""

    memory: Memory
    encoded: EncodedBurst
    whitening: Whitening | None
    solver: Solves
    seed: int = 0
    poses: dict[str, tuple[Reference, PoseEstimate]] = field(default_factory=dict)
    """By category, those that were tried."""

    def judge(self, config: DecisionConfig) -> Judgement:
        """Decides by the memory as it is. Poses are tried where the score is `best` and the burst has depth and cameras."""
        instances = self.memory.instances
        members = instances.enrolled(self.whitening) if config.score == BEST else instances.members()
        past = self.memory.observations.decisions(CALIBRATED_BY) if config.score == BEST else []
        context = Context(self.whitening, past, self._agreement if self._has_poses else None)
        decision = decide(members, self.encoded, config, context)
        return Judgement(decision, self._viewpoints(decision) if decision.outcome == "uncertain" else None)

    @property
    def _has_poses(self) -> bool:
        return bool(len(self.encoded.cloud_m)) and all(view.camera is not None for view in self.encoded.views)

    def _agreement(self, category_id: str) -> float:
        require_wanted()
        try:
            reference = self.memory.categories.reference(category_id)
            estimate, found = self.solver.verify(CategoryReference(category_id, reference), self.encoded, self.whitening, seed=self.seed)
        except (NoPose, InvalidInput, Unavailable):  # nothing of the reference is found in the burst, or the reference is damaged
            return 0.0
        self.poses[category_id] = (reference, estimate)
        return found

    def _viewpoints(self, decision: Decision) -> NDArray[np.floating] | None:
        tried = [self.poses[category] for category, _ in decision.similarities if category in self.poses]
        try:
            laid = [Candidate(reference, estimate.target_from_reference) for reference, estimate in tried]
            return next_viewpoints(self.encoded, laid, self.whitening)
        except (InvalidInput, NoObject):  # no depth or no camera places the object
            return None
