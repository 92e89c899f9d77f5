"""Worse depth and cameras: by as much as was asked for, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import label

from benchmarks.degradations import geometry
from core.errors import InvalidInput
from core.sim3 import rotation_angle_deg
from core.views import Camera, View

K = np.array([[300.0, 0, 160], [0, 310, 120], [0, 0, 1]])


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(3)


def wall(depth_m: float) -> View:
    """A wall that fills the picture, but for a stripe that was not measured."""
    depth = np.full((240, 320), depth_m, np.float32)
    depth[:, :20] = 0
    pose = np.array([[0, -1, 0, 0.1], [1, 0, 0, 0.2], [0, 0, 1, 0.3], [0, 0, 0, 1]])
    return View(np.full((240, 320, 3), 90, np.uint8), depth, Camera(K, pose))


@pytest.mark.parametrize(("depth_m", "deviation_m"), [(1.0, 0.010), (2.0, 0.040), (0.5, 0.0025)])
def test_depth_noise_has_the_deviation_asked_for_and_grows_with_the_square_of_the_distance(depth_m, deviation_m, rng) -> None:
    off = geometry.depth_noise(wall(depth_m), 10, rng).depth_m[:, 20:] - depth_m
    assert off.std() == pytest.approx(deviation_m, rel=0.06)
    assert abs(off.mean()) < 0.15 * deviation_m


def test_depth_noise_is_alike_in_neighbours_and_measures_nothing_new(rng) -> None:
    noisy = geometry.depth_noise(wall(1.0), 10, rng).depth_m
    off = noisy[:, 20:] - 1
    assert np.corrcoef(off[:, :-1].ravel(), off[:, 1:].ravel())[0, 1] > 0.9
    assert abs(np.corrcoef(off[:, :-40].ravel(), off[:, 40:].ravel())[0, 1]) < 0.2
    assert (noisy[:, :20] == 0).all()


def test_depth_is_never_negative(rng) -> None:
    noisy = geometry.depth_noise(wall(4.0), 200, rng).depth_m
    assert (noisy >= 0).all()
    assert (noisy[:, 20:] == 0).any()


@pytest.mark.parametrize("share", [0.3, 0.95])
def test_dropout_takes_the_share_asked_for_in_blobs(share, rng) -> None:
    before = wall(1.0)
    after = geometry.dropout(before, share, rng)
    lost = (before.depth_m > 0) & (after.depth_m == 0)
    assert lost.sum() / (before.depth_m > 0).sum() == pytest.approx(share, abs=0.001)
    assert (after.depth_m[~lost] == before.depth_m[~lost]).all()
    left = ~lost & (before.depth_m > 0)
    assert min(label(lost)[1], label(left)[1]) < 60  # single pixels would be thousands


def test_a_stronger_dropout_takes_more_of_the_same() -> None:
    mild, bad = (geometry.dropout(wall(1.0), share, np.random.default_rng(1)).depth_m > 0 for share in (0.3, 0.8))
    assert (mild | ~bad).all()


def test_a_shifted_camera_is_as_far_off_as_asked(rng) -> None:
    before = wall(1.0)
    moved = geometry.camera_shift(before, 5, rng).camera.world_from_camera
    assert np.linalg.norm(moved[:3, 3] - before.camera.world_from_camera[:3, 3]) == pytest.approx(0.005)
    np.testing.assert_array_equal(moved[:3, :3], before.camera.world_from_camera[:3, :3])


def test_a_turned_camera_is_turned_as_far_as_asked_and_stays_where_it_is(rng) -> None:
    before = wall(1.0)
    turned = geometry.camera_turn(before, 2, rng).camera.world_from_camera
    assert float(rotation_angle_deg(turned[:3, :3], before.camera.world_from_camera[:3, :3])) == pytest.approx(2)
    np.testing.assert_array_equal(turned[:3, 3], before.camera.world_from_camera[:3, 3])


def test_intrinsics_are_off_by_the_percentage_asked_for(rng) -> None:
    wrong = geometry.intrinsics_error(wall(1.0), 5, rng).camera.K
    factor = wrong[0, 0] / K[0, 0]
    assert abs(factor - 1) == pytest.approx(0.05)
    assert wrong[1, 1] / K[1, 1] == pytest.approx(factor)
    assert np.linalg.norm(wrong[:2, 2] - K[:2, 2]) == pytest.approx(0.05 * 320)


@pytest.mark.parametrize("worse", [geometry.depth_noise, geometry.dropout, geometry.camera_shift, geometry.camera_turn])
def test_the_picture_stays(worse, rng) -> None:
    before = wall(1.0)
    assert worse(before, 0.5, rng).rgb is before.rgb


def test_there_must_be_something_to_make_worse(rng) -> None:
    picture = View(np.zeros((240, 320, 3), np.uint8))
    with pytest.raises(InvalidInput, match="depth"):
        geometry.depth_noise(picture, 5, rng)
    with pytest.raises(InvalidInput, match="camera"):
        geometry.camera_turn(picture, 5, rng)
