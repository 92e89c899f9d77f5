"""The agent: looks, decides, says where the object is, and keeps it. No HTTP in it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from core.clock import StageClock
from core.encode import EncodedBurst
from core.errors import Conflict, InvalidInput, NoPose, NotFound, Unavailable
from core.look import Look, look
from core.novelty import Decision, DecisionConfig
from core.packing import burst_from_arrays
from core.pose import PoseConfig, PoseOptions
from core.pose_estimate import PoseEstimate
from core.scan import DEFAULT_VIEWPOINTS, ScanOptions, ScanRequest, request_scan
from core.scores import DEFAULT_SCORE
from core.verification import VERIFYING
from core.views import Burst
from service.cancelling import require_wanted
from service.compute import CategoryReference, Compute
from service.curation import Curation
from service.events import Events
from service.features import features_as_arrays
from service.goals import Rearranging
from service.judgement import Judge, Judgement
from service.scanning import Scanning
from service.upkeep import Upkeep
from store.memory import Memory
from store.observations import Answer, Joins
from store.records import Observation, Pose


@dataclass(frozen=True)
class AgentConfig:
    """What holds for every request that does not say otherwise."""

    score: str = DEFAULT_SCORE
    threshold: float | None = None
    """Least similarity of a known object, and no third answer; None leaves it to the score, of `best` to the rate."""
    variant: str = VERIFYING.variant
    scan_views: int = DEFAULT_VIEWPOINTS
    false_known_rate: float = DecisionConfig.false_known_rate
    """Of objects of no known category, how many may be called known; of score `best`."""

    def validate(self) -> None:
        """Raises InvalidInput for an unknown score or variant."""
        DecisionConfig(self.score, self.threshold, self.false_known_rate)
        PoseConfig.named(self.variant)


@dataclass(frozen=True)
class ObserveOptions:
    """What one request may change."""

    category_id: str | None = None
    """Takes the object for one of this category and skips the decision."""
    threshold: float | None = None
    false_known_rate: float | None = None
    looks: int = 0
    """As in `DecisionConfig`."""
    variant: str | None = None
    pose: PoseOptions = field(default_factory=PoseOptions)
    """Of that variant."""
    alternatives: int | None = None
    """Most other transforms to be given; the variant's own number where left out."""
    learn: bool = True
    """A known object's burst joins its category where the evidence is strong, and the decision counts for later thresholds. False leaves
    what is known as it is: the observation is kept, and nothing is learnt from it."""
    up: tuple[float, float, float] | None = None
    """For the scan of a novel object."""
    seed: int = 0


WITHOUT_DEPTH = "pnp"
DECISIONS = 3
"""For one burst at most: what was decided for may be deleted before the answer is kept; then it is decided anew."""


@dataclass(frozen=True, eq=False)
class _Posed:
    """What was estimated and what is kept of it; or why there is nothing."""

    estimate: PoseEstimate | None = None
    kept: Pose | None = None
    error: str | None = None


class Agent:
    """One memory and the backbone that fills it. Safe to use from several threads."""

    def __init__(self, compute: Compute, memory: Memory, config: AgentConfig, events: Events | None = None) -> None:
        """Raises Conflict where the memory was made with another backbone, InvalidInput for an unknown score or variant."""
        config.validate()
        memory.require_backbone(compute.backbone.name, compute.backbone.fingerprint)
        self.backbone = compute.backbone
        self.encoder = compute.encoder
        self.solver = compute.solver
        self.memory = memory
        self.config = config
        self.events = events or Events()
        self.scanning = Scanning(self.encoder, memory, self.events, config.scan_views)
        self.curation = Curation(self.encoder, memory, self.events, config.score)
        self.upkeep = Upkeep(memory, self.events, config.score, config.threshold, config.false_known_rate)
        self.rearranging = Rearranging(self.observe_known, memory, self.events)

    def observe(self, burst: Burst, options: ObserveOptions | None = None, *, frame: str | None = None) -> Observation:
        """Decides what `burst` shows; a known object gets a pose and joins its category, a novel one gets a scan. The observation is kept.

        Raises NotFound for an unknown category, InvalidInput for an unknown variant, NoObject where nothing is seen.
        """
        options = options or ObserveOptions()
        config = self._pose_config(options, burst)
        if options.category_id is not None:
            self.memory.categories.get(options.category_id)
        clock = StageClock()
        seen = look(burst, self.encoder)
        clock.lap("encode")
        for left in reversed(range(DECISIONS)):
            try:
                return self._decide_and_keep(seen, options, config, clock, frame)
            except (NotFound, Conflict):
                if options.category_id is not None or not left:
                    raise
        raise AssertionError("the last decision is kept or raises")

    def _decide_and_keep(
        self, seen: Look, options: ObserveOptions, config: PoseConfig, clock: StageClock, frame: str | None
    ) -> Observation:
        """Raises NotFound or Conflict where the category that was decided for is deleted meanwhile."""
        judge = self._judge_of(seen.encoded, options.seed)
        judged = None if options.category_id is not None else self._decide(judge, options)
        decision = judged.decision if judged else None
        clock.lap("decide")
        outcome = decision.outcome if decision else "known"
        category_id = None
        posed = _Posed()
        request, scan_error = None, None
        if outcome == "known":
            category_id = decision.similarities[0][0] if decision else options.category_id
            assert category_id is not None
            posed = self._pose(category_id, seen.burst, judge, config, clock)
        elif outcome == "novel":
            request, scan_error = self._scan_or_reason(seen.encoded, options.up)
        answer = Answer(
            outcome=outcome,
            category_id=category_id,
            frame=frame,
            decision=decision,
            pose=posed.kept,
            pose_error=posed.error,
            scan_error=scan_error,
            timings_ms=_timings(clock, seen.encoded, posed.estimate),
            grounds=seen.grounds,
            viewpoints=judged.viewpoints if judged else None,
        )
        joins = _joins(category_id, seen.encoded, decision) if options.learn else None
        features = features_as_arrays(seen.encoded, posed.estimate)
        observation = self.memory.observations.create(answer, seen.burst, features, request, joins=joins)
        self.events.publish("observation", id=observation.id, outcome=outcome, category_id=category_id, timings_ms=answer.timings_ms)
        return observation

    def observe_known(self, burst: Burst, category_id: str, frame: str | None) -> Observation:
        """The pose of an object that is known to be of a category; nothing is learnt."""
        return self.observe(burst, ObserveOptions(category_id, learn=False), frame=frame)

    def decide(self, encoded: EncodedBurst, seed: int = 0) -> Decision:
        """What a burst is taken for, without keeping or learning anything."""
        return self._decide(self._judge_of(encoded, seed), ObserveOptions(learn=False)).decision

    def names(self) -> dict[str, str | None]:
        """Of all categories, by id."""
        return self.memory.categories.names()

    def encoded(self, observation_id: str) -> EncodedBurst:
        """The encoded burst of an observation. Raises NotFound."""
        return burst_from_arrays(self.memory.observations.features(observation_id))

    def _pose_config(self, options: ObserveOptions, burst: Burst) -> PoseConfig:
        """What the caller says; of several views without depth, where nothing was said, the variant that needs none."""
        without_depth = len(burst) > 1 and all(view.depth_m is None for view in burst.views) and options.pose == PoseOptions()
        config = PoseConfig.named(options.variant or (WITHOUT_DEPTH if without_depth else self.config.variant), options.pose)
        if options.alternatives is None:
            return config
        return replace(config, best=replace(config.best, alternatives=options.alternatives))

    def _judge_of(self, encoded: EncodedBurst, seed: int) -> Judge:
        return Judge(self.memory, encoded, self.backbone.whitening, self.solver, seed)

    def _decide(self, judge: Judge, options: ObserveOptions) -> Judgement:
        threshold = self.config.threshold if options.threshold is None else options.threshold
        rate = self.upkeep.false_known_rate if options.false_known_rate is None else options.false_known_rate
        judged = judge.judge(DecisionConfig(self.config.score, threshold, rate, options.looks))
        return judged if options.learn else replace(judged, decision=replace(judged.decision, rival=None))

    def _pose(self, category_id: str, burst: Burst, judge: Judge, config: PoseConfig, clock: StageClock) -> _Posed:
        if category_id in judge.poses and config == VERIFYING:
            reference, estimate = judge.poses[category_id]
            return _Posed(estimate, Pose.of(estimate, reference, burst))
        require_wanted()
        try:
            reference = self.memory.categories.reference(category_id)
            clock.lap("load")
            estimate = self.solver.estimate(CategoryReference(category_id, reference), config, judge.encoded, seed=judge.seed)
        except (NoPose, InvalidInput, Unavailable) as error:  # one damaged category leaves the others working
            return _Posed(error=str(error))
        finally:
            clock.lap("pose")
        return _Posed(estimate, Pose.of(estimate, reference, burst))

    def _scan_or_reason(self, encoded: EncodedBurst, up: tuple[float, float, float] | None) -> tuple[ScanRequest | None, str | None]:
        try:
            return request_scan(encoded, ScanOptions(self.config.scan_views, up)), None
        except InvalidInput as error:
            if error.field == "up":
                raise
            return None, str(error)


def _joins(category_id: str | None, encoded: EncodedBurst, decision: Decision | None) -> Joins | None:
    """A burst joins the category that the caller named, or that the decision is surer of than its answer needs to be."""
    if category_id is None:
        return None
    if decision is None:
        return Joins(category_id, encoded, None, "named")
    similarity = decision.similarities[0][1]
    return Joins(category_id, encoded, similarity, "decision") if similarity > decision.learn_above else None


def _timings(clock: StageClock, encoded: EncodedBurst, estimate: PoseEstimate | None) -> dict[str, float]:
    """Stages that say how they divide replace the whole that was measured around them."""
    laps = dict(clock.stage_ms)
    total = sum(laps.values())
    posed = estimate.stage_ms if estimate else {}
    if "pose" not in laps:  # it came with the decision
        laps["decide"] -= sum(posed.values())
    stages = encoded.stage_ms | {"decide": laps["decide"]} | ({"load": laps["load"]} if "load" in laps else {})
    return stages | posed | {"total": total}
