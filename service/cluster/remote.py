"""What the application asks of others, by Ray Serve's handles: to it they look like what it would have in its own process."""

from __future__ import annotations

import logging
import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import ray
from ray import serve
from ray.exceptions import RayActorError, RayTaskError
from ray.serve.handle import DeploymentHandle
from ray.serve.schema import ReplicaState  # type: ignore[attr-defined]

from core.backbones.whitening import Whitening
from core.encode import EncodedBurst
from core.errors import OneLookError, Unavailable
from core.pose import PoseConfig
from core.pose_estimate import PoseEstimate
from core.reference import Reference
from core.views import Burst
from service.cancelling import require_wanted
from service.compute import CategoryReference
from service.refusals import CalledOff

APPLICATION = "onelook"
ATTEMPTS = 3
"""Of one question: what encodes and solves changes nothing, so another process may be asked where one died."""
LOOK_S = 0.1
"""How often who waits looks whether the answer is still wanted."""
PUBLISHED = 1000
"""References that others may have, those asked for last; about half a megabyte each."""
log = logging.getLogger("onelook")


@dataclass(frozen=True, eq=False)
class Facts:
    """Of the backbone that the encoders have."""

    name: str
    fingerprint: str
    whitening: Whitening | None


@dataclass(frozen=True, eq=False)
class RemoteBackbone:
    """Known by name here; it is in the encoders."""

    name: str
    fingerprint: str
    whitening: Whitening | None

    def require_sound(self) -> None:
        """Raises Unavailable while no encoder or no solver is there."""
        parts = serve.status().applications[APPLICATION].deployments
        for name in ("Encoder", "PoseSolver"):
            if not parts[name].replica_states.get(ReplicaState.RUNNING):
                raise Unavailable(f"no {name} is running; Ray Serve starts them again, and `serve status` says why it cannot")

    def pass_s(self) -> float:
        """0: who has it watches its own passes."""
        return 0.0


class RemoteEncoder:
    """Asks whichever encoder has the least to do."""

    def __init__(self, encoders: DeploymentHandle[Any]) -> None:
        self._encoders = encoders

    def encode(self, burst: Burst) -> EncodedBurst:
        """Raises as `core.encode.Encoder.encode` does, Unavailable, and CalledOff."""
        encoded: EncodedBurst = _result(lambda: self._encoders.encode.remote(burst))
        return encoded


class RemoteSolver:
    """Asks whichever solver has the least to do, and publishes to them the references that they are to use."""

    def __init__(self, solvers: DeploymentHandle[Any]) -> None:
        self._solvers = solvers
        self._published: OrderedDict[str, ray.ObjectRef[Reference]] = OrderedDict()
        self._lock = threading.Lock()

    def estimate(self, known: CategoryReference, config: PoseConfig, target: EncodedBurst, *, seed: int) -> PoseEstimate:
        """Raises as `core.pose.PoseEstimator.estimate` does, Unavailable, and CalledOff."""
        published = self._publish(known)
        estimate: PoseEstimate = _result(lambda: self._solvers.estimate.remote(published, known.category_id, config, target, seed))
        return estimate

    def verify(
        self, known: CategoryReference, target: EncodedBurst, whitening: Whitening | None, *, seed: int
    ) -> tuple[PoseEstimate, float]:
        """Raises as `core.verification.verify` does, Unavailable, and CalledOff."""
        published = self._publish(known)
        verified: tuple[PoseEstimate, float] = _result(
            lambda: self._solvers.verify.remote(published, known.category_id, target, whitening, seed)
        )
        return verified

    def _publish(self, known: CategoryReference) -> ray.ObjectRef[Reference]:
        """Once: Ray keeps one copy a machine, which the processes there read without copying it again."""
        with self._lock:
            if known.category_id not in self._published:
                self._published[known.category_id] = ray.put(known.reference)
            self._published.move_to_end(known.category_id)
            while len(self._published) > PUBLISHED:
                self._published.popitem(last=False)
            return self._published[known.category_id]


def _result(ask: Callable[[], Any]) -> Any:
    """In a thread of the work queue."""
    for attempt in range(1, ATTEMPTS + 1):
        try:
            answer = _awaited(ask())
        except RayActorError as error:
            log.warning("a process ended while it was asked (%d of %d): %s", attempt, ATTEMPTS, error)
            continue
        except RayTaskError as error:
            raise Unavailable(f"what was asked failed ({type(error.cause).__name__}); the log says more") from error
        if isinstance(answer, OneLookError):
            raise answer
        return answer
    raise Unavailable(f"{ATTEMPTS} processes ended while they were asked; the log says more")


def _awaited(response: Any) -> Any:
    while True:
        try:
            return response.result(timeout_s=LOOK_S)
        except TimeoutError:
            try:
                require_wanted()
            except CalledOff:
                response.cancel()
                raise
