"""A device on an arm: what it sees carries the pose it was really brought to."""

from __future__ import annotations

import numpy as np

from clients.cameras.base import ArmCamera, Frame

K = np.array([[50.0, 0, 20], [0, 50, 16], [0, 0, 1]])


class Still:
    """Sees grey, at one metre."""

    def grab(self) -> Frame:
        return Frame(np.full((32, 40, 3), 128, np.uint8), np.ones((32, 40), np.float32), K)


def test_a_view_has_the_pose_that_was_reached_not_the_one_asked_for() -> None:
    asked, reached = np.eye(4), np.eye(4)
    reached[0, 3] = 0.02
    moves = []

    def move(world_from_camera: np.ndarray) -> np.ndarray:
        moves.append(world_from_camera)
        return reached

    view = ArmCamera(Still(), move).look(asked)
    assert moves == [asked]
    assert view.camera is not None
    np.testing.assert_array_equal(view.camera.world_from_camera, reached)
    np.testing.assert_array_equal(view.camera.K, K)
    assert view.depth_m is not None
