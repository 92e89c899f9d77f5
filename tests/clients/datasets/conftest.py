"""A ball in the air, seen by cameras around it: the truth from which tests write folders in published formats, and the proof of a reader.

Letters: H, W image height and width.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from clients.datasets.folders import Sequence, load_burst
from core.camera_poses import look_at
from core.views import Camera

SIZE = (48, 64)
"""(H, W)."""
K = np.array([[70.0, 0, 30.5], [0, 72.0, 25.5], [0, 0, 1]])
BALL = np.array([0.4, -0.2, 0.7])
RADIUS = 0.3
CLOUD = BALL + np.random.default_rng(0).uniform(-0.5, 0.5, (4000, 3)) * [0.2, 0.4, 0.6]
"""Points of a box about the ball's middle, shape (4000, 3)."""


@dataclass(frozen=True, eq=False)
class Shot:
    """What a camera sees: the ball is red, and all around it is grey and not measured."""

    camera: Camera
    rgb: NDArray[np.uint8]
    depth_m: NDArray[np.float32]
    mask: NDArray[np.bool_]


@pytest.fixture(scope="session")
def shots() -> list[Shot]:
    """From three cameras on a circle around the ball."""
    angles = 2 * np.pi * np.arange(3) / 3
    positions = [BALL + 1.5 * np.array([np.cos(a), np.sin(a), 0.6]) for a in angles]
    return [_shot(Camera(K, look_at(position, BALL + 0.05, np.array([0.0, 0, 1])))) for position in positions]


def _shot(camera: Camera) -> Shot:
    pixels = np.stack(np.meshgrid(np.arange(SIZE[1]), np.arange(SIZE[0])), axis=-1).astype(float)
    origin = camera.world_from_camera[:3, 3] - BALL
    ahead = camera.back_project(pixels, np.ones(SIZE)) - camera.world_from_camera[:3, 3]
    a, b, c = (ahead**2).sum(-1), ahead @ origin, origin @ origin - RADIUS**2
    root = b**2 - a * c
    mask = root > 0
    depth_m = np.where(mask, (-b - np.sqrt(np.maximum(root, 0))) / a, 0).astype(np.float32)
    rgb = np.where(mask[..., None], [200, 40, 40], 128).astype(np.uint8)
    return Shot(camera, rgb, depth_m, mask)


@pytest.fixture
def prove(shots: list[Shot]) -> Callable[..., None]:
    """prove(sequence, depth=…, mask=…, tolerance_m=…): its views are the shots, and points project to where the images have them."""

    def check(sequence: Sequence, *, depth: bool = True, mask: bool = True, tolerance_m: float = 2e-3) -> None:
        burst = load_burst(sequence, masks=True)
        assert len(burst) == len(shots)
        for shot, view in zip(shots, burst.views, strict=True):
            assert view.camera is not None
            np.testing.assert_allclose(view.camera.K, shot.camera.K, atol=1e-4)
            np.testing.assert_allclose(view.camera.world_from_camera, shot.camera.world_from_camera, atol=1e-5)
            pixel, _ = view.camera.project(BALL)
            rows, columns = np.nonzero(view.rgb[..., 0].astype(int) - view.rgb[..., 1] > 80)
            np.testing.assert_allclose(pixel, [columns.mean(), rows.mean()], atol=0.6)
            if mask:
                assert view.mask is not None
                np.testing.assert_array_equal(view.mask, shot.mask)
            if depth:
                assert view.depth_m is not None
                inside = np.nonzero(view.depth_m > 0)
                np.testing.assert_array_equal(view.depth_m > 0, shot.mask)
                points = view.camera.back_project(np.stack(inside[::-1], axis=-1).astype(float), view.depth_m[inside])
                np.testing.assert_allclose(np.linalg.norm(points - BALL, axis=1), RADIUS, atol=tolerance_m)

    return check
