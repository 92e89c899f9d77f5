"""Boxes of clouds whose box is known."""

from __future__ import annotations

import numpy as np
import pytest

from core.boxes import BOX_EDGES, cloud_extent_m, oriented_box, remove_outliers, remove_support
from core.errors import NoObject
from core.sim3 import Sim3


def brick(count: int = 400) -> np.ndarray:
    return np.random.default_rng(0).uniform(-0.5, 0.5, (count, 3)) * np.array([0.6, 0.3, 0.1])


@pytest.mark.parametrize("count", [60, 2000])
def test_a_turned_brick_gets_its_own_box(count: int, moved: Sim3) -> None:
    box = oriented_box(moved.apply(brick(count)))
    assert np.allclose(np.sort(box.extent_m), np.array([0.1, 0.3, 0.6]) * moved.scale, rtol=0.25)
    assert np.allclose(box.world_from_object[:3, 3], moved.translation, atol=0.05)
    assert np.isclose(np.linalg.det(box.world_from_object[:3, :3]), 1)


def test_moving_the_box_moves_its_corners(moved: Sim3) -> None:
    box = oriented_box(brick())
    assert np.allclose(box.moved_by(moved).corners(), moved.apply(box.corners()))


def test_corners_lie_on_the_surface_of_their_own_frame(moved: Sim3) -> None:
    box = oriented_box(moved.apply(brick()))
    assert np.allclose(np.abs(box.in_object(box.corners())), box.extent_m / 2)
    assert box.holds(box.corners(), times=1.01).all()
    assert not box.holds(box.corners(), times=0.99).any()


def test_twelve_edges_of_one_axis_each() -> None:
    assert len(BOX_EDGES) == 12
    assert all(bin(first ^ second).count("1") == 1 for first, second in BOX_EDGES)


def test_stray_points_are_removed() -> None:
    cloud = np.concatenate([brick(), [[3.0, 3, 3], [-3, 2, 1]]])
    assert len(brick()) * 0.85 < len(remove_outliers(cloud)) <= len(brick())
    assert np.abs(remove_outliers(cloud)).max() < 1


def disc(radius: float, count: int, z: float = 0.0) -> np.ndarray:
    """Points of a table about the z axis."""
    rng = np.random.default_rng(1)
    angle, away = rng.uniform(0, 2 * np.pi, count), radius * np.sqrt(rng.uniform(0, 1, count))
    return np.stack([away * np.cos(angle), away * np.sin(angle), np.full(count, z) + rng.normal(scale=1e-3, size=count)], axis=1)


CAMERAS_ABOVE = np.array([[1.5, 0, 1.2], [-1.0, 1.0, 1.4], [0.2, -1.6, 0.8]])
STANDING = brick() + np.array([0, 0, 0.051])


@pytest.mark.parametrize("turned", [False, True])
def test_the_table_under_an_object_is_removed_whatever_way_is_up(turned: bool, moved: Sim3) -> None:
    cloud, cameras = np.concatenate([STANDING, disc(0.5, 500)]), CAMERAS_ABOVE
    if turned:
        cloud, cameras = moved.apply(cloud), moved.apply(cameras)
    left = remove_support(cloud, cameras)
    assert len(STANDING) * 0.8 < len(left) <= len(STANDING)
    scale = moved.scale if turned else 1.0
    assert np.allclose(np.sort(oriented_box(left).extent_m), scale * np.array([0.1, 0.3, 0.6]), rtol=0.25)


def test_without_a_table_nothing_is_removed() -> None:
    assert len(remove_support(STANDING, CAMERAS_ABOVE)) == len(STANDING)


def test_sixty_points_on_a_table_are_enough() -> None:
    cloud = np.concatenate([STANDING[:60], disc(0.5, 80)])
    assert 45 <= len(remove_support(cloud, CAMERAS_ABOVE)) <= 60


def test_the_top_of_a_table_is_no_support_when_the_table_is_the_object() -> None:
    leg = brick(150) * np.array([0.1, 0.2, 5]) - np.array([0, 0, 0.27])
    assert len(remove_support(np.concatenate([disc(0.4, 400), leg]), CAMERAS_ABOVE)) == 550


def test_a_flat_object_is_no_support() -> None:
    picture = brick() * np.array([1, 1, 0.01])
    assert len(remove_support(picture, CAMERAS_ABOVE)) == len(picture)


def test_the_densely_seen_face_of_a_box_is_no_support() -> None:
    face = brick(900) * np.array([1, 1, 0]) + np.array([0, 0, 0.001])
    cloud = np.concatenate([STANDING, face])
    assert len(remove_support(cloud, CAMERAS_ABOVE)) == len(cloud)


def test_the_support_is_the_same_every_time() -> None:
    cloud = np.concatenate([STANDING, disc(0.5, 500)])
    assert np.array_equal(remove_support(cloud, CAMERAS_ABOVE), remove_support(cloud, CAMERAS_ABOVE))


@pytest.mark.parametrize(
    "points", [brick(0), brick(1), brick(5), np.ones((30, 3)), np.outer(np.arange(30.0), [1, 2, 3])], ids=["0", "1", "5", "point", "line"]
)
def test_points_that_make_no_plane_are_left_alone(points: np.ndarray) -> None:
    assert np.array_equal(remove_support(points, CAMERAS_ABOVE), points)


def test_five_points_are_no_box() -> None:
    with pytest.raises(NoObject, match="only 5"):
        oriented_box(brick(5))


def test_a_flat_object_gets_a_thin_box() -> None:
    box = oriented_box(brick() * np.array([1, 1, 0]))
    assert np.allclose(np.sort(box.extent_m), [0, 0.3, 0.6], atol=0.02)


def test_extent_of_a_brick_is_its_diagonal() -> None:
    assert np.isclose(cloud_extent_m(brick(4000)), np.linalg.norm([0.6, 0.3, 0.1]), rtol=0.12)
