"""Faults of a view are told, and sound views have none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from clients.datasets.folders import find_sequences, load_burst
from core.quality import Region, faults, region_of_encoded, region_of_mask, region_of_sphere, sharpness
from core.views import Camera, View

from .conftest import PaintedObject


@pytest.fixture(scope="module")
def recorded(samples: Path) -> View:
    """A real view."""
    return load_burst(find_sequences(samples / "cup" / "cup_1")[0], [3]).views[0]


def kinds(view: View, region: Region | None) -> list[str]:
    return [fault.kind for fault in faults(view, region)]


def test_recorded_views_have_no_fault(samples: Path) -> None:
    for sequence in find_sequences(samples):
        for view in load_burst(sequence, [0, 5]).views:
            height, width = view.size
            assert kinds(replace(view, depth_m=None), Region(width / 2, height / 2, min(view.size) / 2)) == [], sequence.path


@pytest.mark.parametrize("motion", [False, True])
def test_blur_is_told(recorded: View, motion: bool) -> None:
    kernel = np.ones((1, 15), np.float32) / 15
    smeared = cv2.filter2D(recorded.rgb, -1, kernel) if motion else cv2.GaussianBlur(recorded.rgb, (0, 0), 3)
    height, width = recorded.size
    assert kinds(replace(recorded, rgb=np.asarray(smeared, dtype=np.uint8), depth_m=None), Region(width / 2, height / 2, 200)) == ["blur"]


def test_a_plain_image_is_not_called_blurred() -> None:
    assert sharpness(np.full((64, 64, 3), 120, np.uint8)) == 1.0


def test_an_object_at_the_border_is_cut_off(recorded: View) -> None:
    assert "cut_off" in kinds(recorded, Region(20, 80, 80))
    assert "cut_off" not in kinds(recorded, Region(recorded.size[1] / 2, recorded.size[0] / 2, 80))


@pytest.mark.parametrize("region", [None, Region(-200, 50, 60)])
def test_an_object_outside_the_image_is_out_of_view(recorded: View, region: Region | None) -> None:
    assert kinds(recorded, region) == ["out_of_view"]


def test_missing_depth_on_the_object_is_told(recorded: View) -> None:
    assert recorded.depth_m is not None
    height, width = recorded.size
    middle = Region(width / 2, height / 2, min(height, width) / 2)
    holes = recorded.depth_m.copy()
    holes[middle.inside(recorded.size)] = 0
    assert kinds(replace(recorded, depth_m=holes), middle) == ["little_depth"]


def test_a_sphere_is_where_the_camera_sees_it() -> None:
    camera: Any = Camera(np.array([[100.0, 0, 50], [0, 100, 40], [0, 0, 1]]), np.eye(4))
    assert region_of_sphere(camera, np.array([0.5, 0, 2.0]), 0.4) == Region(75, 40, pytest.approx(20))
    assert region_of_sphere(camera, np.array([0, 0, -1.0]), 0.4) is None


def test_a_silhouette_is_in_the_square_around_it() -> None:
    mask = np.zeros((40, 60), bool)
    mask[10:14, 20:30] = True
    assert region_of_mask(mask) == Region(24.5, 11.5, 10)


def test_patches_are_in_the_square_around_them(painted: PaintedObject) -> None:
    """Patches of 8 pixels: the object's reach over rows 16 to 39 and columns 40 to 47."""
    view = painted.encode(1).views[0]
    assert region_of_encoded(replace(view, cells=np.array([[2, 5], [4, 5]], np.int16))) == Region(43.5, 27.5, 24)
    assert region_of_encoded(replace(view, cells=np.zeros((0, 2), np.int16))) is None
