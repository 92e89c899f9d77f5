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
    poses: Sequence[Sim3],
    symmetries: FloatArray,
    *,
    center_m: FloatArray,
    diameter_m: float,
    age_s: float,
    elapsed_s: float,
    config: TrackConfig,
) -> Track:
    """The track after a frame that gave a pose.

    Args:
        poses: the estimate and its alternatives, most credible first.
        symmetries: of the reference, shape (S, 3, 3): whatever is found may be meant after one of them as well.
        center_m: the object's middle in the reference's world, shape (3,).
        diameter_m: the reference's.
        age_s: mean age of the views that the estimate rests on.
        elapsed_s: since the last frame.
    """
    if track.pose is None:
        return Track(poses[0], age_s)
    chosen = _nearest(track.pose, with_symmetries(poses, symmetries, center_m), center_m, diameter_m, config)
    if chosen is not None:
        mixed = blend(track.pose, chosen, center_m, config.weight)
        return Track(mixed, config.weight * age_s + (1 - config.weight) * (track.data_age_s + elapsed_s))
    alike = with_symmetries(poses[:1], symmetries, center_m)
    again = None if track.jumped is None else _nearest(track.jumped, alike, center_m, diameter_m, config)
    jumped, jumps = (poses[0], 1) if again is None else (again, track.jumps + 1)
    if jumps >= config.believe_after:
        return Track(jumped, age_s)
    return replace(track, jumped=jumped, jumps=jumps, data_age_s=track.data_age_s + elapsed_s, misses=0)


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


def _nearest(before: Sim3, poses: Sequence[Sim3], center_m: FloatArray, diameter_m: float, config: TrackConfig) -> Sim3 | None:
    """Of those that are no jump from a pose, the one turned least; None where all are."""

    def turned_deg(pose: Sim3) -> float:
        return float(rotation_angle_deg(pose.rotation, before.rotation))

    def jumps(pose: Sim3) -> bool:
        moved_m = float(np.linalg.norm(pose.apply(center_m) - before.apply(center_m)))
        return turned_deg(pose) > config.jump_deg or moved_m > config.jump_extent * diameter_m * before.scale

    return min((pose for pose in poses if not jumps(pose)), key=turned_deg, default=None)
