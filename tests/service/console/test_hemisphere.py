"""A scan's viewpoints as a picture."""

from __future__ import annotations

import numpy as np
import pytest

from core.camera_poses import hemisphere
from core.scan import ScanRequest, coverage
from service.console.hemisphere import CENTRE, HEIGHT, RADIUS, WIDTH, hemisphere_of


@pytest.fixture
def request_of():
    """request_of(up): ten viewpoints about the origin."""

    def made(up):
        up = np.asarray(up, dtype=float) / np.linalg.norm(up)
        return ScanRequest(np.zeros(3), up, 0.5, hemisphere(np.zeros(3), up, 0.5, 10), 0.2)

    return made


@pytest.mark.parametrize("up", [(0, 0, 1), (0, -1, 0), (1, 2, 3)])
def test_every_viewpoint_is_within_the_picture(request_of, up):
    drawn = hemisphere_of(request_of(up), coverage(request_of(up), []))
    assert [mark.covered for mark in drawn.marks] == [False] * 10
    for mark in drawn.marks:
        assert 0 < mark.x < WIDTH
        assert 0 < mark.y < HEIGHT
    for line in drawn.lines:
        places = np.array([place.split() for place in line.removeprefix("M").split("L")], float)
        assert (places >= 0).all()
        assert (places <= (WIDTH, HEIGHT)).all()


def test_far_viewpoints_come_first_and_are_above_near_ones(request_of):
    request, around = request_of((0, 0, 1)), np.tile(np.eye(4), (6, 1, 1))
    angles = 0.3 + np.arange(6) * np.pi / 3
    around[:, :2, 3] = 0.5 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    rim = ScanRequest(np.zeros(3), request.up, 0.5, around, 0.2)
    marks = hemisphere_of(rim, coverage(rim, [])).marks
    assert [mark.behind for mark in marks] == [True] * 3 + [False] * 3
    assert [mark.y < CENTRE[1] for mark in marks] == [True] * 3 + [False] * 3


def test_it_fills_as_views_arrive(request_of):
    request = request_of((0, 0, 1))
    counts = [hemisphere_of(request, coverage(request, list(request.world_from_camera[:seen]))).covered for seen in (0, 1, 10)]
    assert counts == [0, 1, 10]


def test_straight_up_is_the_top_of_the_dome(request_of):
    request = request_of((0, 0, 1))
    above = np.eye(4)
    above[2, 3] = 0.5
    top = ScanRequest(np.zeros(3), request.up, 0.5, above[None], 0.2)
    (mark,) = hemisphere_of(top, coverage(top, [])).marks
    assert mark.x == pytest.approx(CENTRE[0], abs=0.1)
    assert CENTRE[1] - RADIUS < mark.y < CENTRE[1] - 0.8 * RADIUS
