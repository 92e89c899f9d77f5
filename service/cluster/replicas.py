"""What there may be many of: processes that encode bursts and solve poses. They keep nothing that is not elsewhere."""

from __future__ import annotations

import logging.config
from collections.abc import Callable
from typing import TypeVar

from core.backbones.base import Backbone
from core.backbones.whitening import Whitening
from core.encode import EncodedBurst, Encoder
from core.errors import OneLookError
from core.pose import PoseConfig
from core.pose_estimate import PoseEstimate
from core.reference import Reference
from core.views import Burst
from service.app import warm_backbone
from service.batching import BatchingBackbone
from service.cluster.remote import Facts
from service.compute import CategoryReference, Solver
from service.logs import config
from service.settings import Settings

T = TypeVar("T")


def _told(work: Callable[[], T]) -> T | OneLookError:
    """Errors that are answers go back as answers: what is raised Ray takes for a fault of the process, and logs."""
    try:
        return work()
    except OneLookError as error:
        return error


class EncoderReplica:
    """One backbone; bursts that come together share its passes."""

    def __init__(self, settings: Settings, backbone: Backbone | None) -> None:
        logging.config.dictConfig(config(settings.log))
        self._backbone = BatchingBackbone(backbone or warm_backbone(settings), deadline_s=settings.deadline_s)
        self._encoder = Encoder(self._backbone)

    def facts(self) -> Facts:
        """Which backbone it is."""
        return Facts(self._backbone.name, self._backbone.fingerprint, self._backbone.whitening)

    def encode(self, burst: Burst) -> EncodedBurst | OneLookError:
        """See `core.encode.Encoder.encode`."""
        return _told(lambda: self._encoder.encode(burst))

    def check_health(self) -> None:
        """Ray Serve asks this; whoever raises is replaced."""
        self._backbone.require_sound()


class PoseSolverReplica:
    """Solves poses. References come as they were published, from the store of objects that the processes of a machine share."""

    def __init__(self, settings: Settings) -> None:
        logging.config.dictConfig(config(settings.log))
        self._solver = Solver()

    def estimate(
        self, reference: Reference, category_id: str, config: PoseConfig, target: EncodedBurst, seed: int
    ) -> PoseEstimate | OneLookError:
        """See `core.pose.PoseEstimator.estimate`."""
        return _told(lambda: self._solver.estimate(CategoryReference(category_id, reference), config, target, seed=seed))

    def verify(
        self, reference: Reference, category_id: str, target: EncodedBurst, whitening: Whitening | None, seed: int
    ) -> tuple[PoseEstimate, float] | OneLookError:
        """See `core.verification.verify`."""
        return _told(lambda: self._solver.verify(CategoryReference(category_id, reference), target, whitening, seed=seed))
