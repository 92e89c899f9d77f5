"""What fills the machine, behind three names: here in this process; with service/cluster it is in others."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

from core.backbones.whitening import Whitening
from core.encode import EncodedBurst, Encoder
from core.look import Encodes
from core.pose import PoseConfig, PoseEstimator
from core.pose_estimate import PoseEstimate
from core.reference import Reference
from core.verification import verify
from service.batching import BatchingBackbone


class BackboneIdentity(Protocol):
    """Which backbone tokens come from."""

    @property
    def name(self) -> str: ...

    @property
    def fingerprint(self) -> str: ...

    @property
    def whitening(self) -> Whitening | None: ...

    def require_sound(self) -> None:
        """Raises Unavailable where it is known to fail."""
        ...

    def pass_s(self) -> float:
        """For how long a pass has run in this process; 0 where none does."""
        ...


@dataclass(frozen=True, eq=False)
class CategoryReference:
    """A category's reference."""

    category_id: str
    """What is under an id never changes while a memory is open, so it may be kept elsewhere by that name."""
    reference: Reference


class Solves(Protocol):
    """Poses of references on bursts."""

    def estimate(self, known: CategoryReference, config: PoseConfig, target: EncodedBurst, *, seed: int) -> PoseEstimate:
        """See `core.pose.PoseEstimator.estimate`."""
        ...

    def verify(
        self, known: CategoryReference, target: EncodedBurst, whitening: Whitening | None, *, seed: int
    ) -> tuple[PoseEstimate, float]:
        """See `core.verification.verify`."""
        ...


class Solver:
    """In this process."""

    def estimate(self, known: CategoryReference, config: PoseConfig, target: EncodedBurst, *, seed: int) -> PoseEstimate:
        """See `core.pose.PoseEstimator.estimate`."""
        return PoseEstimator(config).estimate(known.reference, target, seed=seed)

    def verify(
        self, known: CategoryReference, target: EncodedBurst, whitening: Whitening | None, *, seed: int
    ) -> tuple[PoseEstimate, float]:
        """See `core.verification.verify`."""
        return verify(known.reference, target, whitening, seed=seed)


@dataclass(frozen=True, eq=False)
class Compute:
    """All of it, for one agent."""

    backbone: BackboneIdentity
    encoder: Encodes
    solver: Solves = field(default_factory=Solver)


def in_this_process(backbone: BatchingBackbone) -> Compute:
    """In this process."""
    return Compute(backbone, Encoder(backbone))
