"""What is kept of the one object that a category was learnt from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core.errors import TooFewViews
from core.pose import PoseEstimator
from core.reference import Reference, build_reference
from core.sim3 import Sim3, rotation_angle_deg

from .conftest import PaintedObject


def test_a_reference_needs_two_views(painted: PaintedObject) -> None:
    with pytest.raises(TooFewViews, match="at least 2 views"):
        painted.reference(1)


def test_a_view_without_a_camera_is_not_kept(painted: PaintedObject, moved: Sim3) -> None:
    scanned = painted.encode(4)
    lost = replace(scanned.views[0], camera=None)
    reference = build_reference(replace(scanned, views=(lost, *scanned.views[1:])))
    assert len(reference.views) == 3
    PoseEstimator().estimate(reference, painted.encode(3, moved))


def test_a_reference_survives_its_arrays(painted: PaintedObject, moved: Sim3) -> None:
    reference = painted.reference(4)
    again = Reference.from_arrays(reference.as_arrays())
    target = painted.encode(3, moved)
    first, second = (PoseEstimator().estimate(each, target).target_from_reference for each in (reference, again))
    assert rotation_angle_deg(first.rotation, second.rotation) < 0.5
    assert np.allclose(again.box.corners(), reference.box.corners())
