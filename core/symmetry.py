"""Under which rotations an object looks as it is: it matches itself after them, in shape and in appearance.

An object is compared with itself by patches of different views, never of the same one. How well it matches unturned says what its
scan can show, and every turn is judged by that: a turn is a symmetry where each place of the surface finds its like again. A side
that no view shows has no like, so nothing is claimed of it.

Letters: Q patches that are compared, P patches they are compared with, S rotations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from torch import Tensor

from core.boxes import OrientedBox, cloud_extent_m, inliers
from core.dense import DenseConfig
from core.descriptors import PcaBasis, unit
from core.encode import EncodedView
from core.errors import NoPose
from core.scan import infer_up
from core.sim3 import Sim3, umeyama
from core.views import FloatArray

CONTINUOUS = 12
"""An order so high, turns of 30°, stands for any turn about the axis."""
GROUPS: dict[int, tuple[int, ...]] = {2: (), CONTINUOUS: (2,), 4: (2,), 3: (), 6: (2, 3)}
"""Orders that are looked for, in this order, and the lower ones that each contains."""
NO_MATCH = -50.0
"""Log agreement of patches that may not be compared."""


@dataclass(frozen=True)
class SymmetryConfig:
    """When a turn counts as a symmetry; lengths are shares of the object's extent."""

    dims: int = 32
    """Components of a descriptor; as the paper's."""
    compared: int = 500
    """Q."""
    against: int = 1200
    """P."""
    agreement: DenseConfig = field(default_factory=DenseConfig)
    """Of patches after a turn; how many there are is said above."""
    place: int = 12
    """Neighbouring patches that make one place: 2.5 % of the surface, enough to see a handle."""
    least_like: float = 0.5
    """Of a place's agreement with itself, what every place must reach after a turn: the middle between as much and none."""
    wander_deg: float = 10.0
    """An axis may be this far off the one that was looked at."""
    wander: float = 0.08
    """The same of its distance to the box's centre; as the inlier threshold of a pose."""
    same_axis_deg: float = 15.0
    """A box's axis this near the vertical is not looked at twice."""


def find_symmetries(views: Sequence[EncodedView], basis: PcaBasis, box: OrientedBox, config: SymmetryConfig | None = None) -> FloatArray:
    """Rotations about the box's centre, in the world frame, that map the object onto itself, identity left out, shape (S, 3, 3).

    Axes looked at are the vertical, told from the cameras, and the box's. A continuous symmetry is given as turns in equal steps.

    Args:
        views: with cameras; patches without measured depth take no part.
    """
    config = config or SymmetryConfig()
    cameras = [view.camera for view in views if view.camera is not None]
    center, axes = box.world_from_object[:3, 3], box.world_from_object[:3, :3].T
    up = infer_up(cameras)[0]
    others = [axis for axis in axes if abs(axis @ up) < np.cos(np.radians(config.same_axis_deg))]
    matches = _SelfAgreement(views, basis, config)
    if not matches.sees_all(matches.unturned):
        return np.zeros((0, 3, 3))
    found = [turn for axis in (up, *others) for turn in _about(matches, axis, center, config)]
    return np.array(found).reshape(-1, 3, 3)


class _SelfAgreement:
    """An object's patches, ready to be compared with those of its other views after a turn."""

    def __init__(self, views: Sequence[EncodedView], basis: PcaBasis, config: SymmetryConfig) -> None:
        trusted = [view.trusted_only() for view in views]
        points = np.concatenate([view.points_m for view in trusted]).astype(float)
        view = np.repeat(np.arange(len(trusted)), [len(each.points_m) for each in trusted])
        eyes = np.stack([np.full(3, np.nan) if each.camera is None else each.camera.world_from_camera[:3, 3] for each in views])
        kept = inliers(points)
        compared, against = _spread(kept, config.compared), _spread(kept, config.against)
        tokens = np.concatenate([each.descriptors for each in trusted])
        described = [torch.from_numpy(unit(basis.project(tokens[chosen], config.dims))) for chosen in (compared, against)]
        rays = eyes[view] - points
        self._config = config
        self._points, self._view = points[compared], view[compared]
        self._against = torch.from_numpy(points[against]).float()
        self._rays = [torch.from_numpy(rays[chosen]).float() for chosen in (compared, against)]
        self._same_view = torch.from_numpy(self._view[:, None] == view[against])
        self._log_cosine = (described[0] @ described[1].T).clamp_min(1e-4).log()
        self.extent_m = cloud_extent_m(points[kept])
        distance = np.linalg.norm(self._points[:, None] - self._points, axis=2)
        self._places = distance.argsort(axis=1)[:, : config.place]
        self.unturned = self.agreement(np.eye(3), np.zeros(3))

    def agreement(self, turn: FloatArray, center_m: FloatArray) -> FloatArray:
        """Of each compared patch, turned about a centre: max over other views' patches of exp(−(d/σ)²)·max(0, cosine), shape (Q,)."""
        near = torch.cdist(self._turned(turn, center_m), self._against) / (self._config.agreement.sigma * self.extent_m)
        return np.asarray((self._comparable(turn) - near**2).amax(dim=1).exp().numpy(), dtype=float)

    def sees_all(self, agreement: FloatArray) -> bool:
        """Whether the object matches itself as well as unturned: on the whole, to within what that differs between views, and at every
        place by half."""
        each_view = [self.unturned[self._view == view].mean() for view in np.unique(self._view)]
        mean, unturned = self.unturned.mean(), self.unturned[self._places].mean(axis=1)
        like = agreement[self._places].mean(axis=1) / np.maximum(unturned, self._config.least_like * mean).clip(1e-9)
        enough = agreement.mean() >= mean - np.std(each_view)
        return bool(enough and like.min() >= self._config.least_like)

    def refine(self, turn: FloatArray, center_m: FloatArray) -> Sim3:
        """Rounds of weighted least squares on soft matches; a rigid motion of the world. Raises NoPose where they determine none."""
        config, motion = self._config.agreement, Sim3.turn_about(center_m, turn)
        comparable = config.refine_power * self._comparable(turn)
        for sigma in config.refine_sigmas:
            placed = torch.from_numpy(motion.apply(self._points)).float()
            log = comparable - (torch.cdist(placed, self._against) / (sigma * self.extent_m)) ** 2
            aims = ((log / config.temperature).softmax(dim=1) @ self._against).double().numpy()
            weights = log.amax(dim=1).exp().double().numpy()
            if weights.sum() < 1e-9:
                raise NoPose("after the turn no patch has a like")
            rotation = umeyama(self._points, aims, weights).rotation
            share = weights / weights.sum()
            motion = Sim3(1.0, rotation, share @ aims - rotation @ (share @ self._points))
        return motion

    def _turned(self, turn: FloatArray, center_m: FloatArray) -> Tensor:
        return torch.from_numpy((self._points - center_m) @ turn.T + center_m).float()

    def _comparable(self, turn: FloatArray) -> Tensor:
        """Log cosine, shape (Q, P), of patches of different views that look, after the turn, from the same side: a surface seen from
        behind is another surface, however thin the object."""
        sides = (self._rays[0] @ torch.from_numpy(turn.T).float()) @ self._rays[1].T
        return self._log_cosine.masked_fill(self._same_view | (sides < 0), NO_MATCH)


def _about(matches: _SelfAgreement, axis: FloatArray, center_m: FloatArray, config: SymmetryConfig) -> list[FloatArray]:
    """The symmetries about one axis: the turns of the highest order that there is."""
    found: dict[int, list[FloatArray]] = {}
    for order, contained in GROUPS.items():
        if all(each in found for each in contained):
            turns = _turns(matches, axis, center_m, order, config)
            if turns:
                found[order] = turns
        if CONTINUOUS in found:
            break
    return found[max(found)] if found else []


def _turns(matches: _SelfAgreement, axis: FloatArray, center_m: FloatArray, order: int, config: SymmetryConfig) -> list[FloatArray]:
    """All turns of an order, about an axis found near the one given; none where one of them is no symmetry."""
    refined_by = _turn(axis, 180.0 if order == CONTINUOUS else 360 / order)
    try:
        motion = matches.refine(refined_by, center_m)
    except NoPose:
        return []
    vector = Rotation.from_matrix(motion.rotation).as_rotvec()
    refined = vector / max(float(np.linalg.norm(vector)), 1e-9)
    still = center_m + np.linalg.lstsq(np.eye(3) - motion.rotation, motion.apply(center_m) - center_m, rcond=1e-3)[0]
    tilted = abs(refined @ axis) < np.cos(np.radians(config.wander_deg))
    if tilted or np.linalg.norm(still - center_m) > config.wander * matches.extent_m:
        return []
    turns = [_turn(refined, 360 / order * step) for step in range(1, order)]
    return turns if all(matches.sees_all(matches.agreement(turn, still)) for turn in turns) else []


def _turn(axis: FloatArray, angle_deg: float) -> FloatArray:
    return np.asarray(Rotation.from_rotvec(np.radians(angle_deg) * axis).as_matrix())


def _spread(indices: NDArray[np.intp], count: int) -> NDArray[np.intp]:
    """Up to `count` of them, evenly: patches lie in order of view, row and column."""
    return indices[np.linspace(0, len(indices) - 1, min(count, len(indices))).round().astype(int)]
