"""Two objects that differ on one side only, of which a burst has seen the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core.camera_poses import angles_about_deg
from core.encode import EncodedBurst
from core.errors import InvalidInput
from core.next_view import LOOKED_DEG, Candidate, next_viewpoints
from core.sim3 import Sim3

from .conftest import PaintedObject

SCAN_VIEWS = 24


def with_another_side(painted: PaintedObject) -> PaintedObject:
    """The same object, but for its half of positive x."""
    other = PaintedObject()
    side = painted.points[:, 0] > 0.04
    other.descriptors = np.where(side[:, None], PaintedObject(seed=9).descriptors, painted.descriptors).astype(np.float32)
    return other


@pytest.fixture
def seen(painted: PaintedObject, moved: Sim3) -> EncodedBurst:
    """Views from the side of negative x only, in another world."""
    burst = painted.encode(SCAN_VIEWS, moved)
    positions = np.stack([moved.inverse().apply(view.camera.world_from_camera[:3, 3]) for view in burst.views if view.camera])
    return burst.select([int(index) for index in np.flatnonzero(positions[:, 0] < -0.3)])


def test_the_differing_side_is_looked_at(painted: PaintedObject, moved: Sim3, seen: EncodedBurst) -> None:
    candidates = [Candidate(each.reference(SCAN_VIEWS), moved) for each in (painted, with_another_side(painted))]
    poses = next_viewpoints(seen, candidates, None)
    assert 1 <= len(poses) <= 3
    first = moved.inverse().apply(poses[0][:3, 3])
    assert first[0] > 0.3


def test_viewpoints_are_apart_from_each_other_and_from_what_was_seen(painted: PaintedObject, moved: Sim3, seen: EncodedBurst) -> None:
    poses = next_viewpoints(seen, [Candidate(painted.reference(6), moved)], None)
    center = np.median(seen.cloud_m, axis=0)
    places = poses[:, :3, 3]
    between = angles_about_deg(places, places, center)[~np.eye(len(poses), dtype=bool)]
    assert (between > LOOKED_DEG).all()
    looked = np.stack([view.camera.world_from_camera[:3, 3] for view in seen.views if view.camera])
    assert (angles_about_deg(places, looked, center).min(axis=1) > LOOKED_DEG).all()


def test_a_burst_without_cameras_has_none(seen: EncodedBurst) -> None:
    blind = EncodedBurst(tuple(replace(view, camera=None) for view in seen.views), "painted")
    with pytest.raises(InvalidInput, match="K and world_from_camera"):
        next_viewpoints(blind, [], None)
