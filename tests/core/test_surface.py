"""The surface of an object faces the cameras that saw it."""

from __future__ import annotations

import numpy as np

from core.surface import Surface

from .conftest import PaintedObject


def test_normals_point_to_the_camera(painted: PaintedObject) -> None:
    painted.points[:, 2] *= 0.01  # a plate, seen from above
    normals = Surface(painted.encode(6).views).normals
    np.testing.assert_allclose(normals[:, 2], 1.0, atol=0.02)
