"""Bad cameras and images are refused by name."""

from __future__ import annotations

import numpy as np
import pytest

from core.errors import InvalidInput
from core.views import Burst, Camera, View

K = np.array([[100.0, 0, 31.5], [0, 100.0, 31.5], [0, 0, 1]])


def view(**changes: object) -> View:
    parts: dict[str, object] = {
        "rgb": np.zeros((64, 64, 3), np.uint8),
        "depth_m": np.ones((64, 64), np.float32),
        "camera": Camera(K, np.eye(4)),
    }
    return View(**{**parts, **changes})  # type: ignore[arg-type]


def depth(value: float) -> np.ndarray:
    return np.full((64, 64), value, np.float32)


@pytest.mark.parametrize(
    ("changes", "field", "words"),
    [
        ({"rgb": np.zeros((64, 64), np.uint8)}, "view.rgb", "(H, W, 3)"),
        ({"rgb": np.zeros((64, 64, 3), np.uint16)}, "view.rgb", "uint8"),
        ({"rgb": np.zeros((64, 31, 3), np.uint8)}, "view.rgb", "31×64 pixels; expected at least 32 a side"),
        ({"rgb": np.zeros((4001, 4000, 3), np.uint8)}, "view.rgb", "at most 16 megapixels"),
        ({"depth_m": depth(800)}, "view.depth", "millimetres sent as metres"),
        ({"depth_m": depth(0.0008)}, "view.depth", "depth_scale"),
        ({"depth_m": depth(0)}, "view.depth", "zero everywhere"),
        ({"depth_m": depth(np.nan)}, "view.depth", "NaN"),
        ({"depth_m": depth(-1)}, "view.depth", "negative"),
        ({"depth_m": np.ones((32, 32), np.float32)}, "view.depth", "align depth"),
        ({"mask": np.zeros((64, 64), bool)}, "view.mask", "empty"),
        ({"mask": np.ones((32, 32), bool)}, "view.mask", "64×64"),
    ],
)
def test_a_bad_image_is_refused(changes: dict[str, object], field: str, words: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        view(**changes)
    assert caught.value.field == field
    assert words in caught.value.message


def turned(matrix: np.ndarray) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3] = matrix
    return pose


@pytest.mark.parametrize(
    ("intrinsics", "pose", "words"),
    [
        (K, turned(np.diag([1.0, 1, -1])), "left-handed"),
        (K, turned(np.eye(3) * 2), "not a rotation"),
        (K, np.full((4, 4), np.nan), "NaN"),
        (K, np.eye(4).T[:3], "shape"),
        (K, np.vstack([np.eye(4)[:3], [1, 2, 3, 1]]), "last row"),
        (-K, np.eye(4), "fx, fy > 0"),
    ],
)
def test_a_bad_camera_is_refused(intrinsics: np.ndarray, pose: np.ndarray, words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        Camera(intrinsics, pose)


def test_intrinsics_of_another_resolution_are_refused() -> None:
    with pytest.raises(InvalidInput, match="scale K to this resolution"):
        view(camera=Camera(np.array([[600.0, 0, 320], [0, 600, 240], [0, 0, 1]]), np.eye(4)))


def test_intrinsics_of_half_the_size_are_refused() -> None:
    with pytest.raises(InvalidInput, match=r"^view\.K: its principal point \(16, 16\) is far from the centre of the 64×64 image"):
        view(camera=Camera(np.array([[50.0, 0, 15.5], [0, 50.0, 15.5], [0, 0, 1]]), np.eye(4)))


def test_an_empty_burst_is_refused() -> None:
    with pytest.raises(InvalidInput, match="at least one view"):
        Burst([])


def test_a_missing_camera_is_named() -> None:
    with pytest.raises(InvalidInput) as caught:
        _ = Burst([view(), view(camera=None)]).cameras
    assert caught.value.field == "views[1].K"


def test_back_projection_undoes_projection() -> None:
    pose = np.eye(4)
    pose[:3, 3] = [0.1, -0.2, -1.5]
    camera = Camera(np.array([[100.0, 3, 31.5], [0, 90.0, 30], [0, 0, 1]]), pose)
    points = np.random.default_rng(0).uniform(-0.3, 0.3, (10, 3))
    pixels, depths = camera.project(points)
    assert np.allclose(camera.back_project(pixels, depths), points)


def test_the_principal_point_looks_straight_ahead() -> None:
    assert np.allclose(Camera(K, np.eye(4)).back_project(np.array([31.5, 31.5]), np.array(2.0)), [0, 0, 2])
