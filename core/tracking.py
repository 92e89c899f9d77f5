"""From a pose for each frame to a steady one: symmetric flips suppressed, noise smoothed, and the age of what is reported known.

Letters: S symmetries.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from core.sim3 import Sim3, rotation_angle_deg
from core.views import FloatArray


@dataclass(frozen=True)
class TrackConfig:
    """How steady, how quick."""

    weight: float = 0.5
    """Of a new pose against what was reported before; 1 smooths nothing."""
    jump_deg: float = 40.0
    """A pose turned farther than this from the last one is taken for a flip, at first."""
    jump_extent: float = 0.5
    """The same for a move, as a share of the object's diameter."""
    believe_after: int = 3
    """Poses in a row that must agree on a jump before it is believed: the object was really moved, or the first pose was wrong."""
    lose_after: int = 3
    """Frames in a row without a pose after which the object counts as lost."""


@dataclass(frozen=True, eq=False)
class Track:
    """What is known of one object between two frames; the empty one has not found it yet."""

    pose: Sim3 | None = None
    """target_from_reference, as reported last."""
    data_age_s: float = 0.0
    """How old what the pose was computed from is on average, at the time of the last frame: the smoothing's lag included."""
    jumped: Sim3 | None = None
    """A pose far from `pose` that waits to be believed."""
    jumps: int = 0
    """Poses in a row that agree with it, itself among them; frames without a pose say nothing."""
    misses: int = 0
    """Frames in a row without a pose."""

    @property
    def found(self) -> bool:
        """Whether it is being followed."""
        return self.pose is not None


def seen(
    track: Track,
    candidates: Sequence[Sim3],
    *,
    center_m: FloatArray,
    diameter_m: float,
    age_s: float,
    elapsed_s: float,
    config: TrackConfig,
) -> Track:
    """The track after a frame that gave a pose.

    Args:
        candidates: the estimate and what may be meant as well: its alternatives, and each turned by a symmetry. Most credible first.
        center_m: the object's middle in the reference's world, shape (3,).
        diameter_m: the reference's.
        age_s: mean age of the views that the estimate rests on.
        elapsed_s: since the last frame.
    """
    if track.pose is None:
        return Track(candidates[0], age_s)
    last = track.pose
    near = [pose for pose in candidates if _near(last, pose, center_m, diameter_m, config)]
    if near:
        chosen = min(near, key=lambda pose: float(rotation_angle_deg(pose.rotation, last.rotation)))
        mixed = blend(last, chosen, center_m, config.weight)
        return Track(mixed, config.weight * age_s + (1 - config.weight) * (track.data_age_s + elapsed_s))
    again = track.jumped is not None and _near(track.jumped, candidates[0], center_m, diameter_m, config)
    jumps = track.jumps + 1 if again else 1
    if jumps >= config.believe_after:
        return Track(candidates[0], age_s)
    return replace(track, jumped=candidates[0], jumps=jumps, data_age_s=track.data_age_s + elapsed_s, misses=0)


def missed(track: Track, elapsed_s: float, config: TrackConfig) -> Track:
    """The track after a frame that gave none: the last pose is kept for a while, then the object is lost."""
    if track.misses + 1 >= config.lose_after:
        return Track(misses=track.misses + 1)
    return replace(track, misses=track.misses + 1, data_age_s=track.data_age_s + elapsed_s)


def with_symmetries(poses: Sequence[Sim3], symmetries: FloatArray, center_m: FloatArray) -> list[Sim3]:
    """Each pose, followed by what it is with the reference turned by each symmetry, shape (S, 3, 3), about its middle, shape (3,)."""
    turns = [Sim3.turn_about(center_m, turn) for turn in np.asarray(symmetries, dtype=float).reshape(-1, 3, 3)]
    return [turned for pose in poses for turned in (pose, *(pose @ turn for turn in turns))]


def blend(before: Sim3, after: Sim3, center_m: FloatArray, weight: float) -> Sim3:
    """Between two poses, `weight` of the way: the object's middle, shape (3,), goes straight, the rotation by the shortest arc, the scale
    by its log."""
    turn = Rotation.from_matrix(after.rotation @ before.rotation.T).as_rotvec()
    rotation = Rotation.from_rotvec(weight * turn).as_matrix() @ before.rotation
    scale = float(before.scale ** (1 - weight) * after.scale**weight)
    middle = (1 - weight) * before.apply(center_m) + weight * after.apply(center_m)
    return Sim3(scale, rotation, middle - scale * rotation @ center_m)


def _near(before: Sim3, after: Sim3, center_m: FloatArray, diameter_m: float, config: TrackConfig) -> bool:
    moved_m = float(np.linalg.norm(after.apply(center_m) - before.apply(center_m)))
    turned_deg = float(rotation_angle_deg(after.rotation, before.rotation))
    return turned_deg <= config.jump_deg and moved_m <= config.jump_extent * diameter_m * before.scale
