"""The agent: looks, decides, asks for views and learns. No HTTP in it."""

from __future__ import annotations

from dataclasses import dataclass

from core.backbones.base import Backbone
from core.clock import StageClock
from core.encode import EncodedBurst, Encoder
from core.errors import InvalidInput, NoPose, TooFewViews
from core.matches import PoseEstimate
from core.novelty import Decision, decide, named_score
from core.packing import burst_from_arrays
from core.pose import PoseConfig, PoseEstimator
from core.reference import MIN_VIEWS, Reference, build_reference
from core.scan import DEFAULT_VIEWPOINTS, ScanOptions, ScanRequest, request_scan
from core.views import Burst
from service.features import best_pair, features_as_arrays
from store.memory import Memory
from store.observations import Answer
from store.records import Category, Observation, Pose, Scan


@dataclass(frozen=True)
class AgentConfig:
    """What holds for every request that does not say otherwise."""

    score: str
    threshold: float
    variant: str = "ucd"
    scan_views: int = DEFAULT_VIEWPOINTS


@dataclass(frozen=True)
class ObserveOptions:
    """What one request may change."""

    category_id: str | None = None
    """Takes the object for one of this category and skips the decision."""
    threshold: float | None = None
    variant: str | None = None
    learn: bool = True
    """A known object's burst joins its category; False leaves what is known as it is."""
    seed: int = 0


_PoseOrReason = tuple[PoseEstimate | None, Pose | None, str | None]
"""What was estimated and what is kept of it; or why there is nothing."""


class Agent:
    """One memory and the backbone that fills it. Safe to use from several threads; calls that encode are better made one at a time."""

    def __init__(self, backbone: Backbone, memory: Memory, config: AgentConfig) -> None:
        """Raises Conflict where the memory was made with another backbone, InvalidInput for an unknown score or variant."""
        named_score(config.score)
        PoseConfig.named(config.variant)
        memory.require_backbone(backbone.name, backbone.fingerprint)
        self.backbone = backbone
        self.memory = memory
        self.config = config
        self._encoder = Encoder(backbone)

    def observe(self, burst: Burst, options: ObserveOptions | None = None, *, frame: str | None = None) -> Observation:
        """Decides what `burst` shows; a known object gets a pose and joins its category, a novel one gets a scan. The observation is kept.

        Raises NotFound for an unknown category, InvalidInput for an unknown variant, NoObject where nothing is seen.
        """
        options = options or ObserveOptions()
        estimator = PoseEstimator(PoseConfig.named(options.variant or self.config.variant))
        if options.category_id is not None:
            self.memory.categories.get(options.category_id)
        clock = StageClock()
        encoded = self._encoder.encode(burst)
        clock.lap("encode")
        decision = None if options.category_id is not None else self._decide(encoded, options.threshold)
        clock.lap("decide")
        outcome = decision.outcome if decision else "known"
        category_id = None
        pose: _PoseOrReason = (None, None, None)
        request, scan_error = None, None
        if outcome == "known":
            category_id = decision.similarities[0][0] if decision else options.category_id
            assert category_id is not None
            pose = self._pose(category_id, encoded, estimator, options.seed, clock)
        elif outcome == "novel":
            request, scan_error = self._scan_or_reason(encoded)
        estimate, record, pose_error = pose
        answer = Answer(outcome, category_id, frame, decision, record, pose_error, scan_error, _timings(clock, encoded, estimate))
        observation = self.memory.observations.create(answer, burst, features_as_arrays(encoded, estimate), request)
        if options.learn and category_id is not None:
            self.memory.categories.assign(category_id, encoded, observation.id)
        return observation

    def encoded(self, observation_id: str) -> EncodedBurst:
        """The encoded burst of an observation. Raises NotFound."""
        observations = self.memory.observations
        return burst_from_arrays(observations.features(observation_id))

    def begin_scan(self, source: Burst | str) -> Scan:
        """A scan of the object of a burst, or of an observation by its id.

        Raises InvalidInput where cameras or depth are missing, NoObject, NotFound.
        """
        if isinstance(source, str):
            return self.memory.scans.create(request_scan(self.encoded(source), ScanOptions(self.config.scan_views)), source)
        return self.memory.scans.create(request_scan(self._encoder.encode(source), ScanOptions(self.config.scan_views)))

    def add_views(self, scan_id: str, burst: Burst) -> Scan:
        """Keeps views for a scan. Raises NotFound, Conflict where it is completed, InvalidInput for views without camera or depth."""
        self.memory.scans.require_open(scan_id)
        for index, view in enumerate(burst.views):
            for name, value in (("K", view.camera), ("depth", view.depth_m)):
                if value is None:
                    raise InvalidInput(
                        f"views[{index}].{name}", "is missing: a reference is made of views with K, world_from_camera and depth"
                    )
        return self.memory.scans.add(scan_id, burst)

    def complete_scan(self, scan_id: str, name: str | None = None) -> Category:
        """Makes the views of a scan a category, in one step. Raises TooFewViews, NoObject, NotFound, Conflict."""
        scan = self.memory.scans.require_open(scan_id)
        burst = self.memory.scans.burst(scan_id)
        if burst is None or len(burst) < MIN_VIEWS:
            found = f"the scan has {scan.views} of at least {MIN_VIEWS} views"
            raise TooFewViews("views", f"{found}; send {MIN_VIEWS - scan.views} more to /v1/scans/{scan_id}/views, from other sides")
        encoded = self._encoder.encode(burst)
        return self.memory.categories.create(build_reference(encoded), burst, encoded, name=name, scan_id=scan_id)

    def _decide(self, encoded: EncodedBurst, threshold: float | None) -> Decision:
        limit = self.config.threshold if threshold is None else threshold
        return decide(self.memory.categories.members(), encoded, score=self.config.score, threshold=limit)

    def _pose(self, category_id: str, encoded: EncodedBurst, estimator: PoseEstimator, seed: int, clock: StageClock) -> _PoseOrReason:
        reference = self.memory.categories.reference(category_id)
        clock.lap("load")
        try:
            estimate = estimator.estimate(reference, encoded, seed=seed)
        except (NoPose, InvalidInput) as error:
            return None, None, str(error)
        finally:
            clock.lap("pose")
        return estimate, _pose_record(estimate, reference), None

    def _scan_or_reason(self, encoded: EncodedBurst) -> tuple[ScanRequest | None, str | None]:
        try:
            return request_scan(encoded, ScanOptions(self.config.scan_views)), None
        except InvalidInput as error:
            return None, str(error)


def _pose_record(estimate: PoseEstimate, reference: Reference) -> Pose:
    return Pose(
        estimate.target_from_reference,
        reference.box.moved_by(estimate.target_from_reference),
        estimate.inliers,
        len(estimate.matches),
        best_pair(estimate.pairs, estimate.matches)[1],
        estimate.residual_m,
        estimate.score,
        estimate.confidence,
        tuple((alternative.target_from_reference, alternative.score) for alternative in estimate.alternatives),
    )


def _timings(clock: StageClock, encoded: EncodedBurst, estimate: PoseEstimate | None) -> dict[str, float]:
    """Stages that say how they divide replace the whole that was measured around them."""
    laps = dict(clock.stage_ms)
    total = sum(laps.values())
    stages = encoded.stage_ms | {"decide": laps["decide"]} | ({"load": laps["load"]} if "load" in laps else {})
    return stages | (estimate.stage_ms if estimate else {}) | {"total": total}
