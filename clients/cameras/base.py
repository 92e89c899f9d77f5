"""What a scan needs of a robot: to look from a pose.

for viewpoint in scan:
    scan.add(camera.look(viewpoint))

Letters: H, W image height and width.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from core.views import Camera, FloatArray, View


class RobotCamera(Protocol):
    """A camera that can be brought to a pose."""

    def look(self, world_from_camera: FloatArray) -> View:
        """The view from a pose, shape (4, 4), or from as near to it as this robot gets; the view's camera says where it was taken."""
        ...


@dataclass(frozen=True, eq=False)
class Frame:
    """What a device sees where it is."""

    rgb: NDArray[np.uint8]
    """Shape (H, W, 3)."""
    depth_m: NDArray[np.float32] | None
    """z-depth aligned to `rgb`, shape (H, W), metres; 0 where nothing was measured."""
    K: FloatArray
    """Intrinsics of `rgb`, shape (3, 3), pixel centres at integers."""


class Device(Protocol):
    """A camera that does not move by itself."""

    def grab(self) -> Frame:
        """What it sees now, not what it saw before it was called."""
        ...


Move = Callable[[FloatArray], FloatArray]
"""Brings the camera to a pose `world_from_camera`, shape (4, 4), waits until it stands still, and returns the pose it really has: the arm's
forward kinematics times the hand–eye calibration."""


@dataclass(frozen=True)
class ArmCamera:
    """A device on a robot's arm."""

    device: Device
    move: Move

    def look(self, world_from_camera: FloatArray) -> View:
        """See `RobotCamera`."""
        reached = self.move(world_from_camera)
        frame = self.device.grab()
        return View(frame.rgb, frame.depth_m, Camera(frame.K, reached))
