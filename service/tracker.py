"""Following one object through frames: a pose for each, from a sliding window of recent views. No HTTP in it."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace

import numpy as np

from core.boxes import OrientedBox, cloud_extent_m
from core.encode import EncodedBurst, EncodedView
from core.errors import InvalidInput, NoObject, NoPose
from core.novelty import Decision
from core.pose import PoseConfig, PoseEstimator
from core.reference import Reference
from core.sim3 import Sim3
from core.tracking import Track, TrackConfig, missed, seen
from core.views import Burst, View
from core.warm import Settled, WarmConfig, follow, settle
from service.agent import Agent


@dataclass(frozen=True)
class TrackOptions:
    """What is said before the first frame."""

    category_id: str | None = None
    """Of the object; decided from the first frames where left out."""
    window: int = 5
    """Views that a pose rests on, the latest ones."""
    variant: str = "ucd"
    seed: int = 0
    track: TrackConfig = field(default_factory=TrackConfig)


@dataclass(frozen=True, eq=False)
class Frame:
    """One view, and when it was taken."""

    id: int
    view: View
    time_s: float
    """On any clock that does not jump."""


@dataclass(frozen=True, eq=False)
class Update:
    """What is known after a frame."""

    frame_id: int
    pose: Sim3 | None
    """target_from_reference, smoothed; the last one where this frame gave none and the object is not lost yet."""
    box: OrientedBox | None
    measured: bool
    """Whether this frame gave a pose; False where the last one is held."""
    views: int
    """That the pose rests on."""
    data_age_s: float | None
    """How old what the pose was computed from is on average: by this it lags behind an object that moves."""
    found: bool
    """Whether the object was found with this frame."""
    lost: bool
    """Whether it was lost with this frame."""
    reason: str | None
    """Why the frame gave no pose."""
    decision: Decision | None
    """Where the category was decided with this frame, or could not be."""


class Tracker:
    """One object. Frames come in the order they were taken, one at a time."""

    def __init__(self, agent: Agent, options: TrackOptions, warm: WarmConfig) -> None:
        """Raises NotFound for an unknown category, InvalidInput for an unknown variant or a window without views."""
        if options.window < 1:
            raise InvalidInput("window", f"expected at least 1 view, found {options.window}")
        self._agent = agent
        self._options = options
        self._warm = warm
        self._estimator = PoseEstimator(PoseConfig.named(options.variant))
        self._views: deque[tuple[EncodedView, float]] = deque(maxlen=options.window)
        self._track = Track()
        self._settled: Settled | None = None
        self._followed = 0
        """Frames since the last full solve."""
        self._last_s: float | None = None
        self._reference: Reference | None = None
        self.category_id: str | None = None
        if options.category_id is not None:
            self._follow(options.category_id)

    def step(self, frame: Frame) -> Update:
        """What is known after `frame`. Raises InvalidInput for a frame that is older than the last one, or lacks camera or depth."""
        if frame.view.camera is None or frame.view.depth_m is None:
            raise InvalidInput("frame", "has no camera or no depth; following an object needs both in every frame")
        if self._last_s is not None and frame.time_s < self._last_s:
            raise InvalidInput(
                "time_s", f"is {frame.time_s}, before the last frame's {self._last_s}; send frames in the order they were taken"
            )
        elapsed_s = 0.0 if self._last_s is None else frame.time_s - self._last_s
        self._last_s = frame.time_s
        before, decision, reason = self._track, None, None
        try:
            self._views.append((self._agent.encoder.encode(Burst([frame.view])).views[0], frame.time_s))
            decision = self._decide() if self._reference is None else None
            if self._reference is None:
                reason = (
                    "the object is of no category so far"
                    if decision is None or decision.outcome == "novel"
                    else "more views would settle it"
                )
            else:
                self._measure(self._reference, frame.time_s, elapsed_s)
        except (NoObject, NoPose) as error:
            reason = str(error)
            self._track = missed(before, elapsed_s, self._options.track)
        lost = before.found and not self._track.found
        if lost:
            self._views.clear()
        return self._update(frame, before, reason, decision, lost)

    def _follow(self, category_id: str) -> None:
        self._reference = self._agent.memory.categories.reference(category_id)
        self.category_id = category_id

    def _decide(self) -> Decision:
        decision = self._agent.decide(self._burst)
        if decision.outcome == "known":
            self._follow(decision.similarities[0][0])
        return decision

    def _measure(self, reference: Reference, now_s: float, elapsed_s: float) -> None:
        poses = self._followed_pose(reference) or self._solved(reference)
        center = reference.box.world_from_object[:3, 3]
        before = self._track
        self._track = seen(
            before,
            poses,
            reference.symmetries,
            center_m=center,
            diameter_m=cloud_extent_m(reference.cloud_m),
            age_s=float(np.mean([now_s - time_s for _, time_s in self._views])),
            elapsed_s=elapsed_s,
            config=self._options.track,
        )
        if before.jumped is not None and self._track.jumped is None:
            while len(self._views) > self._options.track.believe_after:  # earlier views may show the object where it was
                self._views.popleft()

    def _followed_pose(self, reference: Reference) -> list[Sim3]:
        """From the last pose; none where it must be sought anew: a jump waits to be believed, or it was followed for long enough."""
        whole = len(self._views) == self._options.window  # until then each view may tell a better pose
        if self._settled is None or self._track.pose is None or self._track.jumped is not None or not whole:
            return []
        if self._followed >= self._warm.sought_anew_after:
            return []
        before = replace(self._settled, pose=self._track.pose)
        settled = follow(reference, self._burst, before, self._warm, self._options.seed)
        self._settled, self._followed = settled, self._followed + 1
        return [settled.pose] if settled else []

    def _solved(self, reference: Reference) -> list[Sim3]:
        """The estimate and its alternatives, most credible first, after the last pose where that lays the object on better: few views
        mislead a solve more often than a pose that many frames agreed on. Raises NoPose."""
        self._settled, self._followed = None, 0
        estimate = self._estimator.estimate(reference, self._burst, seed=self._options.seed)
        poses = [estimate.target_from_reference, *(each.target_from_reference for each in estimate.alternatives)]
        asked = [pose for pose in (self._track.pose, poses[0]) if pose is not None]
        settled = [settle(reference, self._burst, pose, self._warm, self._options.seed) for pose in asked]
        self._settled = max((each for each in settled if each), key=lambda each: each.score, default=None)
        if self._settled is not None and self._settled.pose is not poses[0]:
            poses.insert(0, self._settled.pose)
        return poses

    @property
    def _burst(self) -> EncodedBurst:
        return EncodedBurst(tuple(view for view, _ in self._views), self._agent.backbone.fingerprint)

    def _update(self, frame: Frame, before: Track, reason: str | None, decision: Decision | None, lost: bool) -> Update:
        pose = self._track.pose
        held = pose is not None and (reason is not None or self._track.jumped is not None)
        return Update(
            frame.id,
            pose,
            self._reference.box.moved_by(pose) if self._reference is not None and pose is not None else None,
            pose is not None and not held,
            len(self._views),
            self._track.data_age_s if pose is not None else None,
            not before.found and self._track.found,
            lost,
            "it is far from the last one, and waits for frames that agree" if held and reason is None else reason,
            decision,
        )
