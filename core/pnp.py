"""A similarity where the target has no depth: Perspective-n-Point on the reference's points (paper, "Limitations").

Letters: N target views, K correspondences.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from core.camera_poses import angles_about_deg
from core.clock import StageClock
from core.errors import NoPose
from core.estimators.base import root_mean_square
from core.matched_pair import MatchedPair
from core.matches import Matches, end_points, pool, rays
from core.pose_estimate import PoseEstimate
from core.sim3 import Sim3
from core.views import FloatArray

MIN_POINTS = 6
"""Correspondences of a view that PnP is tried on, and patches of the target that must agree in the end."""
PNP_TRIALS = 1000
"""Of a robust estimate in one view, at most."""
PNP_CERTAINTY = 0.9999
"""Of having sampled right correspondences alone, with which it may stop before."""
MIN_PARALLAX_DEG = 5.0
"""Angle under which two target views must see the object; below it, how large it is and how far away cannot be told apart."""
REFINEMENTS = 3
"""Rounds of least squares on what agrees, at most."""


@dataclass(frozen=True, eq=False)
class Sight:
    """Matched reference points and the rays on which the target's views see their counterparts."""

    points: FloatArray
    """Of the reference, in its world, shape (K, 3)."""
    rays: FloatArray
    """(x / z, y / z) in the target's camera, shape (K, 2)."""
    view: NDArray[np.intp]
    """Target view of each, shape (K,)."""
    tolerance: FloatArray
    """Error of a ray that still counts as agreement, shape (K,)."""
    camera_from_world: FloatArray
    """Of the target's views, shape (N, 4, 4)."""

    def errors(self, target_from_reference: Sim3) -> FloatArray:
        """How far each point projects from its ray, in tolerances, shape (K,); infinite behind the camera."""
        return self.errors_of(target_from_reference.apply(self.points))

    def residuals(self, target_from_reference: Sim3) -> FloatArray:
        """The same by coordinate, shape (K, 2)."""
        seen = self._in_camera(target_from_reference.apply(self.points))
        return (seen[:, :2] / np.maximum(seen[:, 2:], 1e-6) - self.rays) / self.tolerance[:, None]

    def errors_of(self, world_points: FloatArray) -> FloatArray:
        """See `errors`; for points in the target's world, shape (*, K, 3)."""
        seen = self._in_camera(world_points)
        front = seen[..., 2] > 1e-6
        off = seen[..., :2] / np.where(front, seen[..., 2], 1.0)[..., None] - self.rays
        return np.where(front, np.linalg.norm(off, axis=-1) / self.tolerance, np.inf)

    def _in_camera(self, world_points: FloatArray) -> FloatArray:
        pose = self.camera_from_world[self.view]
        return np.einsum("kij,...kj->...ki", pose[:, :3, :3], world_points) + pose[:, :3, 3]


def by_pnp(pair: MatchedPair, inlier_ratio: float, seed: int, clock: StageClock) -> PoseEstimate:
    """A similarity from reference points and the rays of several target views: PnP in each view, one scale for all, refinement.

    The correspondences of every target view and its most similar reference view are pooled. PnP in one view gives the rotation and, in
    units of the reference's size, the place; size itself comes from the other views, of which each correspondence proposes one scale.
    The pose that most correspondences of all views agree with is refined on them.

    Args:
        inlier_ratio: reprojection error that still counts as agreement, as a share of the target's crop.

    Raises NoPose where the views do not determine size, or nothing fits.
    """
    pairs = pair.best_pairs()
    matches = pool(pair.found, pairs)
    sight = _sight(pair, matches, inlier_ratio)
    best: Sim3 | None = None
    most = 0
    for view in np.unique(sight.view):
        for guess in _scaled(sight, int(view), seed):
            agree = int((sight.errors(guess) < 1).sum())
            if agree > most:
                best, most = guess, agree
    if best is None:
        raise NoPose("PnP finds no pose that several target views agree with; send more views from different sides, or views with depth")
    clock.lap("solve")
    best, inlier = _refine(sight, best)
    distinct = len(np.unique(np.stack([matches.target_view, matches.target_patch])[:, inlier], axis=1).T)
    if distinct < MIN_POINTS:
        raise NoPose(f"only {distinct} patches of the target agree on a pose, at least {MIN_POINTS} are needed; send more views")
    parallax = _parallax_deg(sight, best, inlier)
    if parallax < MIN_PARALLAX_DEG:
        raise NoPose(
            f"without depth the target's size follows from views from different sides; those that agree are {parallax:.0f}° apart, "
            f"at least {MIN_PARALLAX_DEG:.0f}° are needed"
        )
    clock.lap("refine")
    away = np.linalg.norm(best.apply(sight.points) - np.linalg.inv(sight.camera_from_world)[sight.view, :3, 3], axis=1)
    residual_m = root_mean_square((sight.errors(best) * sight.tolerance * away)[inlier])
    return PoseEstimate(best, replace(matches, inlier=inlier), pair.similarity, tuple(pairs), residual_m)


def _sight(pair: MatchedPair, matches: Matches, inlier_ratio: float) -> Sight:
    seen, tolerance = np.zeros((len(matches), 2)), np.zeros(len(matches))
    poses = np.zeros((len(pair.target), 4, 4))
    for index, view in enumerate(pair.target):
        assert view.camera is not None, "require_comparable has asked for it"
        poses[index] = view.camera.camera_from_world
        mine = matches.target_view == index
        seen[mine] = rays(view, matches.target_patch[mine])
        tolerance[mine] = inlier_ratio * view.window.size / view.camera.K[0, 0]
    points, _ = end_points(matches, pair.reference, pair.target)
    return Sight(points.astype(float), seen, matches.target_view, tolerance, poses)


def _scaled(sight: Sight, view: int, seed: int) -> list[Sim3]:
    """The pose that PnP finds in one view, at the scale that most correspondences of other views agree with; empty where there is none."""
    mine = sight.view == view
    if mine.sum() < MIN_POINTS:
        return []
    params = cv2.UsacParams()
    params.randomGeneratorState = seed
    params.maxIterations = PNP_TRIALS
    params.threshold = float(sight.tolerance[mine][0])
    params.confidence = PNP_CERTAINTY
    try:
        found, _, turn, shift, _ = cv2.solvePnPRansac(sight.points[mine], sight.rays[mine], np.eye(3), None, params=params)
    except cv2.error:
        found = False
    if not found:
        return []
    world_from_camera = np.linalg.inv(sight.camera_from_world[view])
    rotation = np.asarray(world_from_camera[:3, :3] @ cv2.Rodrigues(turn)[0], dtype=float)
    centre = world_from_camera[:3, 3]
    shift = world_from_camera[:3, :3] @ shift.ravel()
    scales = _scales(sight, centre, sight.points @ rotation.T + shift, mine)
    if not len(scales):
        return []
    placed = centre + scales[:, None, None] * (sight.points @ rotation.T + shift)
    scale = float(scales[(sight.errors_of(placed) < 1).sum(axis=1).argmax()])
    return [Sim3(scale, rotation, centre + scale * shift)]


def _scales(sight: Sight, centre: FloatArray, directions: FloatArray, mine: NDArray[np.bool_]) -> FloatArray:
    """The factor that brings centre + factor · direction nearest its ray, of each correspondence of other views; positive ones only."""
    pose = sight.camera_from_world[sight.view[~mine]]
    start = np.einsum("kij,j->ki", pose[:, :3, :3], centre) + pose[:, :3, 3]
    along = np.einsum("kij,kj->ki", pose[:, :3, :3], directions[~mine])
    rays = sight.rays[~mine]
    # (start + s · along) projects onto the ray: two equations linear in s
    a = along[:, :2] - rays * along[:, 2:]
    b = start[:, :2] - rays * start[:, 2:]
    scales = -(a * b).sum(axis=1) / np.maximum((a * a).sum(axis=1), 1e-12)
    return scales[scales > 1e-6]


def _refine(sight: Sight, pose: Sim3) -> tuple[Sim3, NDArray[np.bool_]]:
    """Least squares of the reprojection errors of what agrees, while that does not lose agreement."""
    inlier = sight.errors(pose) < 1
    for _ in range(REFINEMENTS):
        start = pose

        def moved(step: FloatArray, start: Sim3 = start) -> Sim3:
            turn = Rotation.from_rotvec(step[:3]).as_matrix()
            return Sim3(start.scale * float(np.exp(step[3])), turn @ start.rotation, start.translation + step[4:] * start.scale)

        fitted = least_squares(lambda step: sight.residuals(moved(step))[inlier].ravel(), np.zeros(7))  # noqa: B023
        again = sight.errors(moved(fitted.x)) < 1
        if again.sum() < inlier.sum():
            break
        pose, inlier = moved(fitted.x), again
    return pose, inlier


def _parallax_deg(sight: Sight, pose: Sim3, inlier: NDArray[np.bool_]) -> float:
    """Largest angle between two target views that agree, at the object."""
    centre = pose.apply(sight.points[inlier].mean(axis=0))
    cameras = np.linalg.inv(sight.camera_from_world[np.unique(sight.view[inlier])])[:, :3, 3]
    return float(angles_about_deg(cameras, cameras, centre).max())
