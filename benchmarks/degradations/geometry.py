"""Worse depth, and cameras that are not where or what they say; the picture stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from benchmarks.degradations.noise import smooth_noise
from core.errors import InvalidInput
from core.views import Camera, FloatArray, View

NOISE_GRAIN = 1 / 160
"""Of depth noise, share of the image's width: a stereo camera matches windows, so neighbours err together, and no median takes that out."""
BLOB_GRAIN = 1 / 40
"""Of what is not measured, likewise: dark and shiny places, not single pixels."""


def depth_noise(view: View, strength: float, rng: np.random.Generator) -> View:
    """Depth off by a deviation of `strength` mm at 1 m, growing with the square of the distance as an error of disparity does."""
    depth_m = _depth(view)
    noise = smooth_noise(view.size, NOISE_GRAIN * view.size[1], rng)
    noisy = depth_m + strength / 1000 * depth_m.astype(float) ** 2 * noise
    return replace(view, depth_m=np.where((depth_m > 0) & (noisy > 0), noisy, 0).astype(np.float32))


def dropout(view: View, strength: float, rng: np.random.Generator) -> View:
    """No depth in blobs that cover the share `strength` of what was measured."""
    depth_m = _depth(view)
    field = smooth_noise(view.size, BLOB_GRAIN * view.size[1], rng)
    lost = field < np.quantile(field[depth_m > 0], strength)
    return replace(view, depth_m=np.where(lost, 0, depth_m).astype(np.float32))


def camera_shift(view: View, strength: float, rng: np.random.Generator) -> View:
    """A camera that is `strength` mm from where it says, in a random direction."""
    camera = _camera(view)
    moved = camera.world_from_camera.copy()
    moved[:3, 3] += strength / 1000 * _direction(rng)
    return replace(view, camera=Camera(camera.K, moved))


def camera_turn(view: View, strength: float, rng: np.random.Generator) -> View:
    """A camera that is turned by `strength` degrees against what it says, about a random axis through itself."""
    camera = _camera(view)
    turned = camera.world_from_camera.copy()
    turned[:3, :3] = turned[:3, :3] @ Rotation.from_rotvec(np.radians(strength) * _direction(rng)).as_matrix()
    return replace(view, camera=Camera(camera.K, turned))


def intrinsics_error(view: View, strength: float, rng: np.random.Generator) -> View:
    """A focal length that is `strength` percent too long or too short, and a principal point as many percent of the width aside."""
    camera = _camera(view)
    K = camera.K.copy()
    K[:2, :2] *= 1 + rng.choice([-1, 1]) * strength / 100
    angle = rng.uniform(0, 2 * np.pi)
    K[:2, 2] += strength / 100 * view.size[1] * np.array([np.cos(angle), np.sin(angle)])
    return replace(view, camera=Camera(K, camera.world_from_camera))


def _direction(rng: np.random.Generator) -> FloatArray:
    vector = rng.standard_normal(3)
    return vector / np.linalg.norm(vector)


def _depth(view: View) -> NDArray[np.float32]:
    if view.depth_m is None:
        raise InvalidInput("view.depth", "is missing: only recordings with depth can have worse depth")
    return view.depth_m


def _camera(view: View) -> Camera:
    if view.camera is None:
        raise InvalidInput("view.camera", "is missing: only recordings with cameras can have worse ones")
    return view.camera
