"""Intel RealSense depth cameras, through pyrealsense2 (`pip install 'onelook[realsense]'`).

Depth is aligned to colour; intrinsics, distortion and depth scale are read from the device, and images are given without distortion.
Tested on recordings that the SDK writes of a software device and plays back, and against its arithmetic, not on a camera.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from clients.cameras.base import Frame
from core.errors import Unavailable
from core.views import FloatArray

WARM_UP_FRAMES = 30
"""After the start, until exposure and white balance have settled: a second."""
STALE_FRAMES = 2
"""That the pipeline may hold from before the arm stood still."""
WAIT_MS = 5000


class RealSense:
    """Grabs frames; a context manager gives the camera back."""

    def __init__(
        self, serial: str | None = None, *, size: tuple[int, int] = (480, 640), fps: int = 30, recording: Path | None = None
    ) -> None:
        """Starts the camera's colour and depth streams.

        Args:
            serial: of the camera; the first one found where left out.
            size: (H, W) of the streams, pixels.
            recording: plays this file of the SDK's recorder in the place of a camera; it has its own size and rate.

        Raises Unavailable where pyrealsense2 is not installed or no camera answers.
        """
        self._rs = _library()
        config = self._rs.config()
        if recording is not None:
            config.enable_device_from_file(str(recording))
        else:
            config.enable_device(self._find(serial))
            height, width = size
            config.enable_stream(self._rs.stream.color, width, height, self._rs.format.rgb8, fps)
            config.enable_stream(self._rs.stream.depth, width, height, self._rs.format.z16, fps)
        self._pipeline = self._rs.pipeline()
        try:
            profile = self._pipeline.start(config)
        except RuntimeError as error:
            remedy = "check its cable (USB 3), that nobody else uses it, and that it has streams of this size and rate"
            raise Unavailable(f"the RealSense camera could not be started ({error}); {remedy}") from error
        self._align = self._rs.align(self._rs.stream.color)
        self.depth_scale_m = float(profile.get_device().first_depth_sensor().get_depth_scale())
        """Metres a unit of its depth images."""
        found = profile.get_stream(self._rs.stream.color).as_video_stream_profile().get_intrinsics()
        self.K = np.array([[found.fx, 0, found.ppx], [0, found.fy, found.ppy], [0, 0, 1]])
        """Of its colour images, shape (3, 3)."""
        self._map = straightening_map(found, self._rs.distortion)
        self._skip(WARM_UP_FRAMES)

    def __enter__(self) -> RealSense:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Stops the streams."""
        self._pipeline.stop()

    def grab(self) -> Frame:
        """See `base.Device`. Raises Unavailable where no frame comes."""
        self._skip(STALE_FRAMES)
        frames = self._align.process(self._wait())
        # Copied: the SDK takes its buffers back.
        rgb = np.array(frames.get_color_frame().get_data(), dtype=np.uint8)
        units = np.asarray(frames.get_depth_frame().get_data())
        depth_m = (units * self.depth_scale_m).astype(np.float32)
        if self._map is not None:
            rgb = np.asarray(cv2.remap(rgb, *self._map, cv2.INTER_LINEAR))
            depth_m = np.asarray(cv2.remap(depth_m, *self._map, cv2.INTER_NEAREST))
        return Frame(rgb, depth_m, self.K)

    def _find(self, serial: str | None) -> str:
        """The serial number of the camera meant. The SDK's own search would wait for a quarter of a minute."""
        found = [device.get_info(self._rs.camera_info.serial_number) for device in self._rs.context().query_devices()]
        if not found or (serial or found[0]) not in found:
            known = f"those connected are {', '.join(found)}" if found else "none is connected"
            raise Unavailable(f"no RealSense camera{f' {serial}' if serial else ''} was found: {known}; check its cable (USB 3)")
        return serial or str(found[0])

    def _skip(self, count: int) -> None:
        for _ in range(count):
            self._wait()

    def _wait(self) -> Any:
        try:
            return self._pipeline.wait_for_frames(WAIT_MS)
        except RuntimeError as error:
            raise Unavailable(f"the RealSense camera gives no frames ({error}); plug it in again") from error


def straightening_map(found: Any, models: Any) -> tuple[NDArray[np.float32], NDArray[np.float32]] | None:
    """Where each pixel of a pinhole camera's image, with the same K, is in the distorted one: x and y, each (H, W); None where it is none.

    Args:
        found: the SDK's intrinsics of a stream.
        models: its names of distortions.

    Raises Unavailable for a distortion that is none of Brown and Conrady's.
    """
    if found.model == models.none or not any(found.coeffs):
        return None
    x, y = np.meshgrid((np.arange(found.width) - found.ppx) / found.fx, (np.arange(found.height) - found.ppy) / found.fy)
    # The SDK projects by one polynomial for both, whatever the name of the second says.
    if found.model not in (models.brown_conrady, models.inverse_brown_conrady):
        raise Unavailable(f"the camera's colour images are distorted in a way that is not known here ({found.model}); rectify them first")
    bent = _polynomial(x, y, found.coeffs)
    across, down = bent[0] * found.fx + found.ppx, bent[1] * found.fy + found.ppy
    return across.astype(np.float32), down.astype(np.float32)


def _polynomial(x: FloatArray, y: FloatArray, coeffs: Sequence[float]) -> tuple[FloatArray, FloatArray]:
    """Brown and Conrady's, of coordinates in the plane at depth 1."""
    k1, k2, p1, p2, k3 = coeffs
    r2 = x**2 + y**2
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2), y * radial + 2 * p2 * x * y + p1 * (r2 + 2 * y**2)


def _library() -> Any:
    try:
        import pyrealsense2
    except ModuleNotFoundError as error:
        raise Unavailable("RealSense cameras need pyrealsense2; run: pip install 'onelook[realsense]'") from error
    return pyrealsense2
