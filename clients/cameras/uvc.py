"""A colour camera that OpenCV can open: USB video class (webcams), video files, network streams. It has no depth."""

from __future__ import annotations

from collections.abc import Sequence
from types import TracebackType

import cv2
import numpy as np

from clients.cameras.base import Frame
from core.errors import Unavailable
from core.views import FloatArray

STALE_FRAMES = 4
"""Frames that a driver may hold from before the arm stood still."""


class UvcCamera:
    """Grabs frames; a context manager gives the camera back."""

    def __init__(self, source: int | str, K: FloatArray, distortion: Sequence[float] = ()) -> None:
        """Opens the camera.

        Args:
            source: the device's number, or a file's or stream's name.
            K: intrinsics of its images, shape (3, 3), pixel centres at integers, from a calibration: such cameras do not tell them.
            distortion: OpenCV's coefficients, from the same calibration; images are given without it.

        Raises Unavailable where it cannot be opened.
        """
        self._K = np.asarray(K, dtype=float)
        self._distortion = np.asarray(distortion, dtype=float)
        self._live = isinstance(source, int)
        self._capture = cv2.VideoCapture(source)
        self._source = source
        if not self._capture.isOpened():
            remedy = "check that it is plugged in, that nobody else uses it, and that you may read /dev/video*"
            raise Unavailable(f"camera {source} cannot be opened; {remedy}")

    def __enter__(self) -> UvcCamera:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Gives the camera back."""
        self._capture.release()

    def grab(self) -> Frame:
        """See `base.Device`. Raises Unavailable where no frame comes."""
        if self._live:
            for _ in range(STALE_FRAMES):
                self._capture.grab()
        there, bgr = self._capture.read()
        if not there:
            raise Unavailable(f"camera {self._source} gives no more frames; check its cable, or the end of the file")
        if self._distortion.any():
            bgr = cv2.undistort(bgr, self._K, self._distortion)
        return Frame(np.asarray(cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB), dtype=np.uint8), None, self._K)
