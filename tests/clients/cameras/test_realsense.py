"""The RealSense camera on what the SDK plays back: a software device, recorded by the SDK's own recorder."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pyrealsense2 as rs
import pytest

from clients.cameras import realsense
from clients.cameras.realsense import RealSense
from core.errors import Unavailable

SIZE = (48, 64)
"""(H, W)."""
DEPTH_UNIT_M = 0.00025
DISTANCE_M = 0.5
OFFSET_M = 0.05
"""The colour camera is this far to the right of the depth camera, as seen from them."""
COLOUR = {"fx": 70.0, "fy": 72.0, "ppx": 30.5, "ppy": 25.5}
DEPTH = {"fx": 60.0, "fy": 60.0, "ppx": 32.0, "ppy": 24.0}


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wall 0.5 m away; what the depth camera sees left of x = 0 is a hole."""
    path = tmp_path_factory.mktemp("realsense") / "wall.db3"
    device = rs.software_device()
    depth_sensor, colour_sensor = device.add_sensor("Depth"), device.add_sensor("Color")
    depth = depth_sensor.add_video_stream(_stream(rs.stream.depth, 1, rs.format.z16, 2, DEPTH))
    colour = colour_sensor.add_video_stream(_stream(rs.stream.color, 2, rs.format.rgb8, 3, COLOUR))
    colour_from_depth = rs.extrinsics()
    colour_from_depth.rotation = [1, 0, 0, 0, 1, 0, 0, 0, 1]
    colour_from_depth.translation = [-OFFSET_M, 0, 0]
    depth_sensor.add_read_only_option(rs.option.depth_units, DEPTH_UNIT_M)
    depth.register_extrinsics_to(colour, colour_from_depth)
    recorder = rs.recorder(str(path), device)
    queue, sensors = rs.frame_queue(50), recorder.query_sensors()
    for sensor in sensors:
        sensor.open(sensor.get_stream_profiles()[0])
        sensor.start(queue)
    wall = np.full(SIZE, round(DISTANCE_M / DEPTH_UNIT_M), np.uint16)
    wall[:, :32] = 0
    pictures = [np.full((*SIZE, 3), (200, 100, number), np.uint8) for number in range(8)]
    for number, picture in enumerate(pictures):
        depth_sensor.on_video_frame(_frame(depth, wall, number, 2))
        colour_sensor.on_video_frame(_frame(colour, picture, number, 3))
        time.sleep(0.02)
    time.sleep(0.2)
    for sensor in sensors:
        sensor.stop()
        sensor.close()
    del recorder, sensors, sensor  # closes the file
    return path


def _stream(kind: Any, number: int, form: Any, bytes_a_pixel: int, camera: dict[str, float]) -> Any:
    stream, intrinsics = rs.video_stream(), rs.intrinsics()
    intrinsics.height, intrinsics.width = stream.height, stream.width = SIZE
    intrinsics.model, intrinsics.coeffs = rs.distortion.none, [0.0] * 5
    for name, value in camera.items():
        setattr(intrinsics, name, value)
    stream.type, stream.index, stream.uid, stream.fps, stream.bpp, stream.fmt = kind, 0, number, 30, bytes_a_pixel, form
    stream.intrinsics = intrinsics
    return stream


def _frame(profile: Any, pixels: np.ndarray, number: int, bytes_a_pixel: int) -> Any:
    frame = rs.software_video_frame()
    frame.pixels, frame.bpp, frame.stride = pixels, bytes_a_pixel, SIZE[1] * bytes_a_pixel
    frame.timestamp, frame.domain, frame.frame_number = 1000 + 33.0 * number, rs.timestamp_domain.hardware_clock, number + 1
    frame.profile = profile.as_video_stream_profile()
    if bytes_a_pixel == 2:
        frame.depth_units = DEPTH_UNIT_M
    return frame


@pytest.fixture(autouse=True)
def short_warm_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """The recording is a quarter of a second long."""
    monkeypatch.setattr(realsense, "WARM_UP_FRAMES", 1)


def test_intrinsics_and_depth_scale_are_the_devices(recording: Path) -> None:
    with RealSense(recording=recording) as camera:
        np.testing.assert_allclose(camera.K, [[70, 0, 30.5], [0, 72, 25.5], [0, 0, 1]])
        assert camera.depth_scale_m == pytest.approx(DEPTH_UNIT_M)


def test_depth_is_aligned_to_colour(recording: Path) -> None:
    """The wall begins at the depth camera's column 32, x = 0, which is 5 cm to the colour camera's left: column 30.5 - 70 · 0.05 / 0.5."""
    with RealSense(recording=recording) as camera:
        frame = camera.grab()
    np.testing.assert_array_equal(frame.rgb[0, 0, :2], (200, 100))
    assert frame.depth_m is not None
    assert frame.depth_m.shape == frame.rgb.shape[:2] == SIZE
    row = frame.depth_m[24]
    assert np.flatnonzero(row)[0] == pytest.approx(30.5 - 70 * OFFSET_M / DISTANCE_M, abs=1.5)
    np.testing.assert_allclose(row[row > 0], DISTANCE_M, atol=DEPTH_UNIT_M)


def test_frames_are_copies_of_their_own(recording: Path) -> None:
    with RealSense(recording=recording) as camera:
        first = camera.grab()
        kept = first.rgb.copy()
        for _ in range(3):
            camera.grab()
    np.testing.assert_array_equal(first.rgb, kept)


def test_no_camera_is_said_with_the_remedy() -> None:
    with pytest.raises(Unavailable, match="no RealSense camera was found: none is connected; .*USB 3"):
        RealSense()
    with pytest.raises(Unavailable, match="no RealSense camera 1234 was found"):
        RealSense("1234")


def test_a_file_that_is_no_recording_is_said(tmp_path: Path) -> None:
    (tmp_path / "wall.db3").write_text("no recording")
    with pytest.raises(Unavailable, match="could not be started"):
        RealSense(recording=tmp_path / "wall.db3")


def test_a_missing_library_is_said_with_the_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyrealsense2", None)
    with pytest.raises(Unavailable, match=r"pip install 'onelook\[realsense\]'"):
        RealSense()


@pytest.mark.parametrize("model", [rs.distortion.brown_conrady, rs.distortion.inverse_brown_conrady])
def test_a_lens_is_taken_out_as_the_sdk_does(model: Any) -> None:
    """The ray that the SDK gives a distorted pixel is that of the pinhole camera's pixel which takes its colour from there."""
    lens = _stream(rs.stream.color, 1, rs.format.rgb8, 3, COLOUR).intrinsics
    lens.model, lens.coeffs = model, [-0.056, 0.065, 0.001, -0.0008, -0.02]
    found = realsense.straightening_map(lens, rs.distortion)
    assert found is not None
    across, down = found
    assert np.abs(across - np.arange(SIZE[1])).max() > 0.1
    for row, column in ((0, 0), (5, 60), (40, 10), (47, 63)):
        x, y, _ = rs.rs2_deproject_pixel_to_point(lens, [float(across[row, column]), float(down[row, column])], 1.0)
        np.testing.assert_allclose([x, y], [(column - 30.5) / 70, (row - 25.5) / 72], atol=3e-5)


def test_no_lens_is_left_alone_and_an_unknown_one_is_said() -> None:
    lens = _stream(rs.stream.color, 1, rs.format.rgb8, 3, COLOUR).intrinsics
    lens.model = rs.distortion.inverse_brown_conrady
    assert realsense.straightening_map(lens, rs.distortion) is None
    lens.model, lens.coeffs = rs.distortion.ftheta, [0.1, 0, 0, 0, 0]
    with pytest.raises(Unavailable, match="ftheta"):
        realsense.straightening_map(lens, rs.distortion)
