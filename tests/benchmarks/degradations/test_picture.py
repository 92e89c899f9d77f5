"""Worse pictures."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.degradations import picture
from core.views import Camera, View

K = np.array([[300.0, 0, 159.5], [0, 300, 119.5], [0, 0, 1]])


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(3)


def plain(value: int) -> View:
    return View(np.full((240, 320, 3), value, np.uint8), np.ones((240, 320), np.float32), Camera(K, np.eye(4)))


@pytest.mark.parametrize("length_px", [0.5, 3, 12.3, 40])
def test_a_blurring_kernel_keeps_the_mean_and_is_as_long_as_asked(length_px: float) -> None:
    kernel = picture.line_kernel(length_px, 0.7)
    assert kernel.sum() == pytest.approx(1)
    row, column = np.indices(kernel.shape) - len(kernel) // 2
    assert abs((kernel * row).sum()) < 1e-6  # in the middle
    along = row * np.sin(0.7) + column * np.cos(0.7)
    across = column * np.sin(0.7) - row * np.cos(0.7)
    assert np.sqrt(12 * (kernel * along**2).sum()) == pytest.approx(length_px, abs=0.9)  # a uniform line's deviation is its length / √12
    assert np.sqrt((kernel * across**2).sum()) < 0.6


def test_blur_keeps_light_and_spreads_an_edge(rng) -> None:
    view = plain(0)
    view.rgb[:, 160:] = 255
    blurred = picture.motion_blur(view, 10, rng)
    before, after = (picture.to_light(each.rgb).mean() for each in (view, blurred))
    assert after == pytest.approx(before, abs=0.005)
    between = ((blurred.rgb[120, :, 0] > 5) & (blurred.rgb[120, :, 0] < 250)).sum()
    assert 2 < between <= 33  # a tenth of 320 pixels, more or less of it across the edge


def test_light_and_back_is_the_same() -> None:
    values = np.arange(256, dtype=np.uint8)
    np.testing.assert_array_equal(picture.from_light(picture.to_light(values)), values)


@pytest.mark.parametrize(("worse", "stops"), [(picture.underexposure, -2), (picture.overexposure, 1)])
def test_exposure_multiplies_light(worse, stops: int, rng) -> None:
    before = plain(120)
    after = worse(before, abs(stops), rng)
    assert picture.to_light(after.rgb).mean() == pytest.approx(2.0**stops * picture.to_light(before.rgb).mean(), rel=0.02)


def test_too_bright_is_white_and_the_dark_is_noisy(rng) -> None:
    assert (picture.overexposure(plain(200), 2, rng).rgb == 255).all()
    dark = picture.to_light(picture.underexposure(plain(200), 6, rng).rgb)
    electrons = picture.FULL_WELL * picture.to_light(np.array(200, np.uint8)) / 64
    assert dark.std() == pytest.approx(np.sqrt(electrons + picture.READ_NOISE**2) / picture.FULL_WELL, rel=0.1)


def test_low_quality_costs_more_than_high(rng) -> None:
    row, column = np.indices((64, 64))
    view = View(np.stack([row * 3, column * 3, row + column], axis=2).astype(np.uint8))
    high, low = (np.abs(picture.jpeg(view, quality, rng).rgb.astype(int) - view.rgb).mean() for quality in (95, 5))
    assert 0 < high < low / 2


def test_fewer_pixels_look_along_the_same_rays(rng) -> None:
    view = plain(100)
    view.depth_m[:120] = 2
    small = picture.resolution(view, 4, rng)
    assert small.size == (60, 80)
    corners = np.array([[-0.5, -0.5], [319.5, 239.5]])
    np.testing.assert_allclose(
        view.camera.back_project(corners, np.ones(2)), small.camera.back_project(np.array([[-0.5, -0.5], [79.5, 59.5]]), np.ones(2))
    )
    assert (small.depth_m[:30] == 2).all()
    assert (small.depth_m[30:] == 1).all()
