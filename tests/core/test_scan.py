"""A scan asks for viewpoints around an object, replaces those out of reach, and tells which were taken."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.camera_poses import look_at, nearest_view
from core.errors import InvalidInput
from core.scan import LEAST_STANDOFF_M, OBJECT_SHARE, REACH_DEG, ScanOptions, coverage, exclude, infer_up, request_scan, standoff_m
from core.sim3 import Sim3
from core.views import Camera

from .conftest import K, PaintedObject


@pytest.mark.parametrize("rotation", Rotation.random(6, rng=0).as_matrix())
def test_up_is_inferred_from_level_cameras_and_never_down(rotation: np.ndarray, painted: PaintedObject) -> None:
    cameras = [view.camera for view in painted.encode(5, Sim3(1.0, rotation, np.zeros(3))).views if view.camera]
    up, source = infer_up(cameras)
    assert up @ rotation[:, 2] > 0.999
    assert source == "cameras"


def test_one_camera_does_not_tell_up() -> None:
    up, source = infer_up([Camera(K, look_at(np.array([1.0, 0, 1]), np.zeros(3), np.array([0.0, 0, 1])))])
    assert source == "assumed"
    assert up == pytest.approx([0, 0, 1], abs=1e-9)


def test_a_scan_is_requested_about_the_object(moved: Sim3, painted: PaintedObject) -> None:
    request = request_scan(painted.encode(4, moved), ScanOptions(12))
    assert request.world_from_camera.shape == (12, 4, 4)
    assert np.linalg.norm(request.center_m - moved.translation) < 0.1
    assert request.up_from == "cameras"


def test_a_scan_is_asked_for_about_the_object_though_some_patches_are_of_the_wall(painted: PaintedObject) -> None:
    encoded = painted.encode(8)
    first = encoded.views[0]
    strays = first.points_m.copy()
    strays[: len(strays) // 3] += (0.0, 0.0, 4.0)
    strayed = replace(encoded, views=(replace(first, points_m=strays), *encoded.views[1:]))
    assert request_scan(strayed).radius_m == pytest.approx(request_scan(encoded).radius_m, rel=0.1)


def test_the_object_fills_its_share_of_the_image(moved: Sim3, painted: PaintedObject) -> None:
    request = request_scan(painted.encode(4, moved))
    camera = Camera(K, request.world_from_camera[0])
    across = camera.project(request.center_m + request.extent_m * np.stack([-request.up, request.up]) / 2)[0]
    seen = request.extent_m * K[0, 0] / request.radius_m
    assert seen == pytest.approx(OBJECT_SHARE * 2 * K[0, 2])
    assert np.linalg.norm(across[1] - across[0]) <= seen


def test_a_small_object_is_not_approached_closer_than_depth_cameras_measure() -> None:
    assert standoff_m(0.01, [Camera(K, np.eye(4))]) == LEAST_STANDOFF_M


def test_up_and_standoff_can_be_given(moved: Sim3, painted: PaintedObject) -> None:
    request = request_scan(painted.encode(4, moved), ScanOptions(20, (0, 0, 3.0), 0.7))
    assert (request.up_from, request.up.tolist(), request.radius_m) == ("given", [0, 0, 1], 0.7)
    assert np.allclose(np.linalg.norm(request.world_from_camera[:, :3, 3] - request.center_m, axis=1), 0.7)


@pytest.mark.parametrize("up", [(0.0, 0.0, 0.0), (float("nan"), 0.0, 1.0)])
def test_up_has_a_direction(moved: Sim3, painted: PaintedObject, up: tuple[float, float, float]) -> None:
    with pytest.raises(InvalidInput, match="up"):
        request_scan(painted.encode(2, moved), ScanOptions(up=up))


def test_an_excluded_viewpoint_is_replaced_in_its_place(moved: Sim3, painted: PaintedObject) -> None:
    request = request_scan(painted.encode(4, moved))
    other = exclude(request, [2, 7])
    assert len(other.world_from_camera) == len(request.world_from_camera)
    kept = [index for index in range(10) if index not in {2, 7}]
    assert np.array_equal(other.world_from_camera[kept], request.world_from_camera[kept])
    for replaced in (2, 7):
        pose = other.world_from_camera[replaced]
        Camera(K, pose)
        assert nearest_view(pose, other.excluded, request.center_m)[1] > REACH_DEG
        others = np.delete(other.world_from_camera, replaced, axis=0)
        assert nearest_view(pose, others, request.center_m)[1] > REACH_DEG / 2


def test_what_was_excluded_stays_excluded(moved: Sim3, painted: PaintedObject) -> None:
    request = request_scan(painted.encode(4, moved))
    for _ in range(3):
        request = exclude(request, [0])
    assert len(request.excluded) == 3
    assert all(nearest_view(pose, request.excluded, request.center_m)[1] > REACH_DEG for pose in request.world_from_camera)


def test_with_every_direction_unreachable_there_is_no_scan(moved: Sim3, painted: PaintedObject) -> None:
    request = request_scan(painted.encode(4, moved), ScanOptions(64))
    with pytest.raises(InvalidInput, match="no viewpoint is left"):
        exclude(request, range(64))


def test_only_viewpoints_that_there_are_can_be_excluded(moved: Sim3, painted: PaintedObject) -> None:
    with pytest.raises(InvalidInput, match="10 is none of the scan's viewpoints 0 to 9"):
        exclude(request_scan(painted.encode(4, moved)), [10])


def test_coverage_says_which_viewpoint_each_view_stands_for(moved: Sim3, painted: PaintedObject) -> None:
    request = request_scan(painted.encode(4, moved))
    below = look_at(request.center_m - 1.5 * request.up + [0.1, 0, 0], request.center_m, request.up)
    found = coverage(request, [request.world_from_camera[4], below])
    assert found.viewpoint == (4, None)
    assert found.angle_deg[0] == pytest.approx(0, abs=1e-4)
    assert [index for index, covered in enumerate(found.covered) if covered] == [4]
    assert coverage(request, []).covered == (False,) * 10
