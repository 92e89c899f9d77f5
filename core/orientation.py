"""How a target is turned where neither object has depth (paper, "Limitations"): two-view geometry of similar views, averaged.

The cameras' poses in each world are known, lengths in the images are not: a rotation follows, of the translation only a direction, of
the scale nothing. The result has no place for one.

Letters: M reference views, N target views, K correspondences.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np

from core.clock import StageClock
from core.descriptors import PcaBasis, component_count
from core.encode import EncodedBurst, EncodedView
from core.errors import InvalidInput, NoPose
from core.matched_pair import MatchedPair, require_comparable
from core.matches import pool, rays
from core.sim3 import rotation_angle_deg
from core.viewpoints import consensus, mean_rotation
from core.views import FloatArray

MIN_CORRESPONDENCES = 8
"""Of a view pair whose essential matrix is estimated: five determine it, the rest tell whether it is right."""
TRIALS = 1000
"""Of a robust estimate, at most."""
CERTAINTY = 0.9999
"""Of having sampled right correspondences alone, with which it may stop before."""
MIN_PARALLAX_DEG = 10.0
"""Angle between the two views of a pair that a direction is taken from: two views from one place have none."""


@dataclass(frozen=True)
class OrientationConfig:
    """Settings; the defaults are those of UCD, as far as they concern rotation."""

    dims: int | None = 32
    correspondences: int = 50
    method: str = "cyclical"
    """`cyclical-3d` is not possible here: it needs depth."""
    consensus_deg: float = 30.0
    """For the view pairs, and for the rotations of their essential matrices about those."""

    def __post_init__(self) -> None:
        if self.method not in ("nearest", "mutual", "cyclical"):
            raise InvalidInput("method", f"expected nearest, mutual or cyclical without depth, found {self.method!r}")


@dataclass(frozen=True, eq=False)
class Appearance:
    """What a scan without depth gives of a reference: views and their principal components, no cloud and no box."""

    views: tuple[EncodedView, ...]
    basis: PcaBasis
    fingerprint: str

    @staticmethod
    def of(encoded: EncodedBurst) -> Appearance:
        """Of the views that show an object."""
        views = tuple(view for view in encoded.views if len(view.cells))
        return Appearance(views, PcaBasis.fit(np.concatenate([view.descriptors for view in views])), encoded.fingerprint)


@dataclass(frozen=True, eq=False)
class Orientation:
    """A rotation and a direction. Without depth there is no scale and no distance."""

    rotation: FloatArray
    """target_from_reference, shape (3, 3)."""
    direction: FloatArray
    """Unit vector in the target's world, shape (3,): from the camera of target view `pairs[0][1]` to where the camera of reference view
    `pairs[0][0]` would stand about the target."""
    spread_deg: float
    """Root mean square angle of the view pairs' rotations from `rotation`."""
    pairs: tuple[tuple[int, int], ...]
    """(reference view, target view) pairs whose essential matrices agree; first those that see the objects from different sides, then by
    inliers."""
    view_similarity: FloatArray
    """S, shape (M, N)."""
    stage_ms: dict[str, float] = field(default_factory=dict)


def estimate_orientation(
    reference: Appearance, target: EncodedBurst, config: OrientationConfig | None = None, *, seed: int = 0
) -> Orientation:
    """See module.

    View pairs that agree on a rotation are found as ever ("Aggregating multi-view correspondences"). Every pair that this rotation
    brings together gives an essential matrix, and that a rotation; those near the consensus are averaged.

    Raises InvalidInput for tokens of another backbone or views without cameras, NoPose where no view pair supports a rotation.
    """
    config, clock = config or OrientationConfig(), StageClock()
    require_comparable(reference, target)
    dims = component_count(config.dims, reference.basis.components.shape[1])
    pair = MatchedPair(reference, target, dims, config.correspondences, config.method, depth=(False, False))
    best = pair.best_pairs()
    if not best:
        raise NoPose("no view of the target resembles any view of the reference; send more views")
    clock.lap("match")
    rotations = pair.rotations(best)
    coarse = mean_rotation(rotations[consensus(rotations, pair.similarities(best), config.consensus_deg, seed)])
    near = rotation_angle_deg(pair.relative, coarse) <= config.consensus_deg
    clock.lap("views")
    found = [_two_view(pair, int(i), int(j), seed) for i, j in np.argwhere(near & (pair.similarity > 0))]
    agreeing = [each for each in found if each and rotation_angle_deg(each.rotation, coarse) <= config.consensus_deg]
    if not agreeing:
        raise NoPose("no essential matrix supports the rotation that similar views suggest; send more views or views with depth")
    turns = np.stack([each.rotation for each in agreeing])
    rotation = mean_rotation(turns)
    apart = rotation_angle_deg(pair.rotations([each.pair for each in agreeing]), rotation)
    order = sorted(range(len(agreeing)), key=lambda index: (apart[index] < MIN_PARALLAX_DEG, -agreeing[index].inliers))
    agreeing = [agreeing[index] for index in order]
    clock.lap("solve")
    spread = float(np.sqrt((rotation_angle_deg(turns, rotation) ** 2).mean()))
    pairs = tuple(each.pair for each in agreeing)
    return Orientation(rotation, agreeing[0].direction, spread, pairs, pair.similarity, clock.stage_ms)


@dataclass(frozen=True, eq=False)
class _TwoView:
    pair: tuple[int, int]
    rotation: FloatArray
    """target_from_reference, shape (3, 3)."""
    direction: FloatArray
    """As of `Orientation`."""
    inliers: int


def _two_view(pair: MatchedPair, reference_view: int, target_view: int, seed: int) -> _TwoView | None:
    """The relative pose of two cameras, as if both saw one object; None where the correspondences do not give one."""
    views = pair.reference[reference_view], pair.target[target_view]
    matches = pool(pair.found, [(reference_view, target_view)])
    if len(matches) < MIN_CORRESPONDENCES:
        return None
    seen = rays(views[0], matches.reference_patch), rays(views[1], matches.target_patch)
    params = cv2.UsacParams()
    params.randomGeneratorState, params.maxIterations, params.confidence = seed, TRIALS, CERTAINTY
    params.threshold = _patch_angle(views[1])
    try:
        essential, mask = cv2.findEssentialMat(*seen, np.eye(3), np.eye(3), None, None, params)
        if essential is None or essential.shape != (3, 3):
            return None
        inliers, turn, shift, _ = cv2.recoverPose(essential, *seen, np.eye(3), mask=mask)
    except cv2.error:
        return None
    from_reference, from_target = (view.camera.world_from_camera[:3, :3] for view in views if view.camera is not None)
    direction = from_target @ shift.ravel()
    return _TwoView((reference_view, target_view), from_target @ turn @ from_reference.T, direction, int(inliers))


def _patch_angle(view: EncodedView) -> float:
    """A patch's side on the image plane at distance 1: correspondences are no finer."""
    assert view.camera is not None, "require_comparable has asked for it"
    return float(view.window.size / view.grid / view.camera.K[0, 0])
