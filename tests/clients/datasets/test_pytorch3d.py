"""PyTorch3D's cameras: hand-computed cases, and its own projection written out."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from clients.datasets.pytorch3d import camera_from_pytorch3d
from core.errors import InvalidInput

SIZE = (200, 400)
"""(H, W): twice as wide as high."""


def test_a_point_straight_ahead_is_at_the_centre() -> None:
    """R = I, T = (0, 0, 5): the camera is 5 behind the world's origin, which is seen between the four middle pixels."""
    camera = camera_from_pytorch3d(np.eye(3), np.array([0.0, 0, 5]), (1, 1), (0, 0), SIZE, "ndc_isotropic")
    pixel, depth = camera.project(np.zeros(3))
    np.testing.assert_allclose(pixel, [199.5, 99.5])
    assert depth == pytest.approx(5)


def test_left_and_up_are_positive_there() -> None:
    """x = 1 is left and y = 1 is up of the centre; at depth 5 with f = 2 each is 2·1/5 = 0.4 NDC, 0.4 half shorter sides, 40 pixels."""
    camera = camera_from_pytorch3d(np.eye(3), np.array([0.0, 0, 5]), (2, 2), (0, 0), SIZE, "ndc_isotropic")
    np.testing.assert_allclose(camera.project(np.array([1.0, 0, 0]))[0], [199.5 - 40, 99.5])
    np.testing.assert_allclose(camera.project(np.array([0.0, 1, 0]))[0], [199.5, 99.5 - 40])


def test_older_ndc_scales_each_side_for_itself() -> None:
    """0.4 NDC are 0.4 · 200 = 80 pixels across and 0.4 · 100 = 40 down."""
    camera = camera_from_pytorch3d(np.eye(3), np.array([0.0, 0, 5]), (2, 2), (0, 0), SIZE, "ndc_norm_image_bounds")
    np.testing.assert_allclose(camera.project(np.array([1.0, 1, 0]))[0], [199.5 - 80, 99.5 - 40])


@pytest.mark.parametrize(("form", "across"), [("ndc_isotropic", 10), ("ndc_norm_image_bounds", 20)])
def test_the_principal_point_is_towards_the_left(form: str, across: float) -> None:
    camera = camera_from_pytorch3d(np.eye(3), np.array([0.0, 0, 5]), (2, 2), (0.1, -0.1), SIZE, form)
    np.testing.assert_allclose(camera.K[:2, 2], [199.5 - across, 99.5 + 10])


def test_screen_coordinates_are_pixels_from_the_corner() -> None:
    camera = camera_from_pytorch3d(np.eye(3), np.array([0.0, 0, 5]), (200, 210), (190, 110), SIZE, "screen")
    np.testing.assert_allclose(camera.K, [[200, 0, 189.5], [0, 210, 109.5], [0, 0, 1]])


def pytorch3d_pixels(
    points: NDArray[np.floating],
    R: NDArray[np.floating],
    T: NDArray[np.floating],
    focal: NDArray[np.floating],
    principal: NDArray[np.floating],
) -> NDArray[np.floating]:
    """As PyTorch3D says it projects: row vectors to the view, to isotropic NDC, to the screen whose corner is (0, 0)."""
    view = points @ R + T
    ndc = focal * view[:, :2] / view[:, 2:] + principal
    half = np.array([SIZE[1], SIZE[0]]) / 2
    return half - ndc * half.min()


def test_any_camera_projects_as_pytorch3d_does() -> None:
    rng = np.random.default_rng(0)
    for seed in range(5):
        R = Rotation.random(random_state=seed).as_matrix()
        T, focal, principal = rng.normal(size=3) + [0, 0, 8], rng.uniform(1, 4, 2), rng.uniform(-0.1, 0.1, 2)
        points = rng.normal(size=(10, 3))
        camera = camera_from_pytorch3d(R, T, focal.tolist(), principal.tolist(), SIZE, "ndc_isotropic")
        pixels, depths = camera.project(points)
        np.testing.assert_allclose(pixels + 0.5, pytorch3d_pixels(points, R, T, focal, principal), atol=1e-9)
        np.testing.assert_allclose(depths, (points @ R + T)[:, 2])


def test_another_format_is_named() -> None:
    with pytest.raises(InvalidInput, match="'raster'"):
        camera_from_pytorch3d(np.eye(3), np.zeros(3), (1, 1), (0, 0), SIZE, "raster")
