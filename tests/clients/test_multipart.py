"""How a burst travels."""

from __future__ import annotations

import io
import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from clients.multipart import burst_npz, burst_parts
from core.errors import InvalidInput
from core.views import Burst, Camera, View

CAMERA = Camera(np.array([[50.0, 0, 20], [0, 50, 16], [0, 0, 1]]), np.eye(4))
VIEW = View(np.full((32, 40, 3), (200, 100, 50), np.uint8), np.full((32, 40), 1.234, np.float32), CAMERA)


def test_parts_hold_cameras_colour_and_depth_in_their_units() -> None:
    parts = burst_parts(Burst([VIEW, VIEW]), frame="map")
    assert [name for name, _ in parts] == ["burst", "rgb", "rgb", "depth", "depth"]
    about = json.loads(parts[0][1][1])
    assert about["frame"] == "map"
    assert about["views"][1]["K"] == CAMERA.K.tolist()
    depth = cv2.imdecode(np.frombuffer(parts[3][1][1], np.uint8), cv2.IMREAD_UNCHANGED)
    np.testing.assert_allclose(depth * about["depth_scale"], 1.234, atol=about["depth_scale"] / 2)
    bgr = cv2.imdecode(np.frombuffer(parts[1][1][1], np.uint8), cv2.IMREAD_COLOR)
    np.testing.assert_allclose(bgr[16, 20], (50, 100, 200), atol=3)


def test_images_alone_have_no_cameras_and_no_depth() -> None:
    parts = burst_parts(Burst([View(VIEW.rgb)]))
    assert [name for name, _ in parts] == ["burst", "rgb"]
    assert "views" not in json.loads(parts[0][1][1])


@pytest.mark.parametrize("field", ["depth_m", "camera"])
def test_what_only_some_views_have_is_refused(field: str) -> None:
    partial = replace(VIEW, **{field: None})
    with pytest.raises(InvalidInput, match=r"views\[1\].*all views or for none"):
        burst_parts(Burst([VIEW, partial]))


def test_depth_beyond_16_bits_is_refused() -> None:
    far = replace(VIEW, depth_m=np.full((32, 40), 80.0, np.float32))
    with pytest.raises(InvalidInput, match=r"views\[0\]\.depth: reaches 80\.0 m"):
        burst_parts(Burst([far]))


def test_an_npz_is_exact() -> None:
    with np.load(io.BytesIO(burst_npz(Burst([VIEW, VIEW]))), allow_pickle=False) as arrays:
        assert set(arrays) == {"rgb", "depth_m", "K", "world_from_camera"}
        np.testing.assert_array_equal(arrays["rgb"][1], VIEW.rgb)
        np.testing.assert_array_equal(arrays["depth_m"][0], VIEW.depth_m)
        np.testing.assert_array_equal(arrays["world_from_camera"], [np.eye(4)] * 2)


def test_an_npz_has_images_of_one_size() -> None:
    with pytest.raises(InvalidInput, match="2 sizes"):
        burst_npz(Burst([View(VIEW.rgb), View(VIEW.rgb[:, :36].copy())]))
