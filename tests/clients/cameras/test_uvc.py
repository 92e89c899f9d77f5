"""The OpenCV camera, on a video file in the place of a device."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from clients.cameras import uvc
from clients.cameras.uvc import UvcCamera
from core.errors import Unavailable

K = np.array([[60.0, 0, 31.5], [0, 60, 23.5], [0, 0, 1]])


@pytest.fixture
def video(tmp_path: Path) -> Path:
    """Three frames: red, green, blue."""
    path = tmp_path / "video.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 30, (64, 48))
    for colour in ((0, 0, 220), (0, 220, 0), (220, 0, 0)):
        writer.write(np.full((48, 64, 3), colour, np.uint8))
    writer.release()
    return path


def test_frames_are_rgb_with_the_calibrated_intrinsics(video: Path) -> None:
    with UvcCamera(str(video), K) as camera:
        first, second = camera.grab(), camera.grab()
        assert first.rgb.shape == (48, 64, 3)
        np.testing.assert_allclose(first.rgb[24, 32], (220, 0, 0), atol=12)
        np.testing.assert_allclose(second.rgb[24, 32], (0, 220, 0), atol=12)
        assert first.depth_m is None
        np.testing.assert_array_equal(first.K, K)
        camera.grab()
        with pytest.raises(Unavailable, match="no more frames"):
            camera.grab()


def test_a_lens_is_taken_out(tmp_path: Path) -> None:
    """A straight edge, bent by the lens, is straight again."""
    K = np.array([[30.0, 0, 31.5], [0, 30, 23.5], [0, 0, 1]])
    distortion = [-0.35, 0.1, 0.0, 0.0]
    straight = np.zeros((48, 64, 3), np.uint8)
    straight[:, :16] = 255
    across, down = np.meshgrid(np.arange(64.0), np.arange(48.0))
    seen = np.stack([across.ravel(), down.ravel()], axis=-1)[:, None]
    source = cv2.undistortPoints(seen, K, np.array(distortion), P=K).reshape(48, 64, 2).astype(np.float32)
    bent = cv2.remap(straight, source[..., 0], source[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    cv2.imwrite(str(tmp_path / "frame_0.png"), bent)
    with UvcCamera(str(tmp_path / "frame_%d.png"), K, distortion) as camera:
        mended = camera.grab().rgb[4:-4, 4:-4, 0] > 127
    edges = mended.sum(axis=1)
    bent_edges = (bent[4:-4, 4:-4, 0] > 127).sum(axis=1)
    assert np.ptp(bent_edges) > 1
    assert np.ptp(edges) <= 1


def test_old_frames_of_a_live_camera_are_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    """A device, in the shape of cv2.VideoCapture, that counts its frames in their brightness."""

    class Live:
        def __init__(self, source: int) -> None:
            self.frame = 0

        def isOpened(self) -> bool:
            return True

        def grab(self) -> bool:
            self.frame += 1
            return True

        def read(self) -> tuple[bool, np.ndarray]:
            self.grab()
            return True, np.full((48, 64, 3), self.frame, np.uint8)

        def release(self) -> None: ...

    monkeypatch.setattr(uvc.cv2, "VideoCapture", Live)
    with UvcCamera(0, K) as camera:
        assert camera.grab().rgb[0, 0, 0] == uvc.STALE_FRAMES + 1
        assert camera.grab().rgb[0, 0, 0] == 2 * (uvc.STALE_FRAMES + 1)


def test_a_camera_that_is_not_there_is_named() -> None:
    with pytest.raises(Unavailable, match=r"nowhere\.avi cannot be opened"):
        UvcCamera("nowhere.avi", K)
