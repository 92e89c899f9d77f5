"""Folders with a transforms.json, as Instant-NGP, nerfstudio and NeRF write them, written here and read back."""

from __future__ import annotations

import json
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from clients.datasets import transforms
from clients.datasets.folders import load_burst
from core.errors import InvalidInput

OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
INTRINSICS = {"w": 64, "h": 48, "fl_x": 70.0, "fl_y": 72.0, "cx": 31.0, "cy": 26.0}
"""The shots' K; its principal point (30.5, 25.5) counts from the first pixel's centre, these from the image's corner."""


def npy(array: np.ndarray) -> bytes:
    """As numpy's file."""
    file = BytesIO()
    np.save(file, array)
    return file.getvalue()


def write(
    folder: Path, shots: list[Any], scene: dict[str, Any], frame: Callable[[int, Any], dict[str, Any]], name: str = "transforms.json"
) -> Path:
    """Images, and a file whose frames have what `frame` says beside their image and pose."""
    (folder / "images").mkdir(parents=True)
    frames = []
    for number, shot in enumerate(shots):
        cv2.imwrite(str(folder / "images" / f"{number:04}.png"), shot.rgb[..., ::-1])
        pose = (shot.camera.world_from_camera @ OPENGL).tolist()
        frames.append({"file_path": f"images/{number:04}.png", "transform_matrix": pose, **frame(number, shot)})
    (folder / name).write_text(json.dumps({**scene, "frames": frames}))
    return folder


def depth_png(folder: Path, number: int, shot: Any, unit_m: float) -> str:
    path = folder / "depth" / f"{number:04}.png"
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), np.round(shot.depth_m / unit_m).astype(np.uint16))
    return f"depth/{number:04}.png"


def test_instant_ngp_without_depth(tmp_path: Path, shots: list[Any], prove: Callable[..., None]) -> None:
    write(tmp_path / "cup" / "blue", shots, INTRINSICS | {"aabb_scale": 4, "k1": 0, "k2": 0, "p1": 0, "p2": 0}, lambda n, shot: {})
    (sequence,) = transforms.find_sequences(tmp_path)
    assert sequence.name == "cup/blue"
    prove(sequence, depth=False, mask=False)
    assert load_burst(sequence).views[0].depth_m is None


def test_instant_ngp_with_depth(tmp_path: Path, shots: list[Any], prove: Callable[..., None]) -> None:
    folder, unit_m = tmp_path / "cup" / "blue", 4 / 65535
    scene = INTRINSICS | {"integer_depth_scale": unit_m, "enable_depth_loading": True}
    write(folder, shots, scene, lambda n, shot: {"depth_path": depth_png(folder, n, shot, unit_m)})
    prove(transforms.find_sequences(folder)[0], mask=False)


def test_nerfstudio_with_depth_masks_and_intrinsics_of_each_frame(tmp_path: Path, shots: list[Any], prove: Callable[..., None]) -> None:
    def frame(number: int, shot: Any) -> dict[str, Any]:
        (tmp_path / "masks").mkdir(exist_ok=True)
        cv2.imwrite(str(tmp_path / "masks" / f"{number}.png"), shot.mask.astype(np.uint8) * 255)
        return INTRINSICS | {"depth_file_path": depth_png(tmp_path, number, shot, 0.001), "mask_path": f"masks/{number}.png"}

    write(tmp_path, shots, {"camera_model": "OPENCV"}, frame)
    (sequence,) = transforms.find_sequences(tmp_path)
    prove(sequence)
    assert load_burst(sequence).views[0].mask is None
    assert all(path.exists() for path in sequence.reader.files(sequence))


def test_nerfstudio_can_say_its_depth_unit(tmp_path: Path, shots: list[Any], prove: Callable[..., None]) -> None:
    scene = INTRINSICS | {"depth_unit_scale_factor": 0.0005}
    write(tmp_path / "a", shots, scene, lambda n, shot: {"depth_file_path": depth_png(tmp_path / "a", n, shot, 0.0005)})
    prove(transforms.find_sequences(tmp_path)[0], mask=False)


def test_intrinsics_of_full_size_images_are_scaled(tmp_path: Path, shots: list[Any], prove: Callable[..., None]) -> None:
    write(tmp_path, shots, {name: 2 * value for name, value in INTRINSICS.items()}, lambda n, shot: {})
    prove(transforms.find_sequences(tmp_path)[0], depth=False, mask=False)


def test_the_synthetic_scenes_of_nerf(tmp_path: Path, shots: list[Any]) -> None:
    """Square pixels from the horizontal angle of view, names without suffix, transparency for a silhouette."""
    angle = 2 * np.arctan(32 / 70)

    def frame(number: int, shot: Any) -> dict[str, Any]:
        rgba = np.dstack([shot.rgb[..., ::-1], shot.mask * 255]).astype(np.uint8)
        cv2.imwrite(str(tmp_path / "images" / f"r_{number}.png"), rgba)
        return {"file_path": f"./images/r_{number}"}

    write(tmp_path, shots, {"camera_angle_x": angle}, frame, "transforms_train.json")
    view = load_burst(transforms.find_sequences(tmp_path)[0], [0], masks=True).views[0]
    assert view.camera is not None
    np.testing.assert_allclose(view.camera.K, [[70, 0, 31.5], [0, 70, 23.5], [0, 0, 1]])
    np.testing.assert_array_equal(view.mask, shots[0].mask)


def test_distorted_images_are_straightened(tmp_path: Path, shots: list[Any]) -> None:
    """A point of the ball that a distorting lens would show elsewhere is where the pinhole camera has it again."""
    distortion = np.array([-0.3, 0.05, 0.01, -0.005])
    K = shots[0].camera.K
    across, down = np.meshgrid(np.arange(64.0), np.arange(48.0))
    seen = np.stack([across.ravel(), down.ravel()], axis=-1)[:, None]
    straight = cv2.undistortPoints(seen, K, distortion, P=K).reshape(48, 64, 2).astype(np.float32)
    bent = [
        type(shot)(shot.camera, cv2.remap(shot.rgb, straight[..., 0], straight[..., 1], cv2.INTER_LINEAR), shot.depth_m, shot.mask)
        for shot in shots
    ]
    scene = INTRINSICS | dict(zip(("k1", "k2", "p1", "p2"), distortion.tolist()))
    write(tmp_path, bent, scene, lambda n, shot: {})
    for view, shot, raw in zip(load_burst(transforms.find_sequences(tmp_path)[0]).views, shots, bent, strict=True):
        inner = cv2.erode(shot.mask.astype(np.uint8), np.ones((5, 5))) > 0
        outer = cv2.dilate(shot.mask.astype(np.uint8), np.ones((5, 5))) == 0
        red = view.rgb[..., 0].astype(int) - view.rgb[..., 1] > 80
        assert red[inner].all()
        assert not red[outer].any()
        assert not np.array_equal(view.rgb, raw.rgb)


@pytest.mark.parametrize(
    ("scene", "says"),
    [
        ({"camera_model": "OPENCV_FISHEYE", **INTRINSICS}, "undistort the images"),
        ({"w": 64, "h": 48}, "camera_angle_x"),
    ],
)
def test_cameras_that_cannot_be_read_are_named(tmp_path: Path, shots: list[Any], scene: dict[str, Any], says: str) -> None:
    write(tmp_path, shots, scene, lambda n, shot: {})
    with pytest.raises(InvalidInput, match=says):
        load_burst(transforms.find_sequences(tmp_path)[0])


def test_what_is_missing_is_named(tmp_path: Path, shots: list[Any]) -> None:
    with pytest.raises(InvalidInput, match=r"transforms\.json"):
        transforms.find_sequences(tmp_path)
    write(tmp_path / "a", shots, INTRINSICS, lambda n, shot: {"file_path": "images/lost.png"})
    with pytest.raises(InvalidInput, match=r"frames\[0\]\.file_path"):
        transforms.find_sequences(tmp_path / "a")
    (tmp_path / "a" / "transforms.json").write_text("{}")
    with pytest.raises(InvalidInput, match="frames"):
        transforms.find_sequences(tmp_path / "a")
    write(tmp_path / "b", shots, INTRINSICS, lambda n, shot: {"depth_path": depth_png(tmp_path / "b", n, shot, 0.001)})
    with pytest.raises(InvalidInput, match="integer_depth_scale"):
        load_burst(transforms.find_sequences(tmp_path / "b")[0])


@pytest.mark.parametrize(
    ("change", "field", "says"),
    [
        (lambda frame: frame.pop("transform_matrix"), "frames[2].transform_matrix", "expected 16 numbers, row by row, found None"),
        (lambda frame: frame["transform_matrix"].append(1), "frames[2].transform_matrix", "expected 16 numbers"),
        (lambda frame: frame.update(fl_x="wide"), "frames[2].fl_x", "expected a number, found 'wide'"),
        (lambda frame: frame.pop("file_path"), "frames[2].file_path", "expected the name of an image"),
        (lambda frame: frame.update(file_path="images/-.png"), "frames[2].file_path", "is no file"),
        (lambda frame: frame.update(w=0), "frames[2].w", "expected a width in pixels, found 0"),
        (lambda frame: frame.update(depth_file_path=3), "frames[2].depth_file_path", "expected the name of a file, found 3"),
        (lambda frame: frame.update(fl_x=0), "frames[2].camera.K", "expected"),
        (
            lambda frame: frame.update(transform_matrix=[[2, 0, 0, 0], *np.eye(4)[1:].tolist()]),
            "frames[2].camera.world_from_camera",
            "rotation",
        ),
    ],
)
def test_what_is_wrong_with_a_frame_is_named_by_its_place_in_the_file(
    tmp_path: Path, shots: list[Any], change: Callable[[dict[str, Any]], object], field: str, says: str
) -> None:
    file = write(tmp_path / "a", shots, INTRINSICS, lambda n, shot: {}) / "transforms.json"
    scene = json.loads(file.read_text())
    scene["frames"].reverse()  # they are read in the order of their images' names
    change(scene["frames"][2])
    file.write_text(json.dumps(scene))
    with pytest.raises(InvalidInput, match=says) as caught:
        load_burst(transforms.find_sequences(tmp_path / "a")[0])
    assert caught.value.field == f"{file}: {field}"


def test_a_silhouette_is_looked_for_only_when_it_is_asked_for(tmp_path: Path, shots: list[Any]) -> None:
    write(tmp_path / "a", shots, INTRINSICS, lambda n, shot: {"mask_path": "masks/lost.png"})
    (sequence,) = transforms.find_sequences(tmp_path / "a")
    assert len(load_burst(sequence)) == len(shots)
    with pytest.raises(InvalidInput, match="is no file") as caught:
        load_burst(sequence, masks=True)
    assert caught.value.field == str(tmp_path / "a" / "masks" / "lost.png")


def test_the_files_of_a_sequence_need_depth_that_has_a_name(tmp_path: Path, shots: list[Any]) -> None:
    write(tmp_path / "a", shots, INTRINSICS, lambda n, shot: {"depth_path": 3})
    (sequence,) = transforms.find_sequences(tmp_path / "a")
    with pytest.raises(InvalidInput, match="expected the name of a file, found 3"):
        sequence.reader.files(sequence)


def test_a_pose_may_leave_out_its_last_row(tmp_path: Path, shots: list[Any], prove: Callable[..., None]) -> None:
    rows = [(shot.camera.world_from_camera @ OPENGL)[:3].tolist() for shot in shots]
    write(tmp_path / "a", shots, INTRINSICS, lambda n, shot: {"transform_matrix": rows[n]})
    prove(transforms.find_sequences(tmp_path / "a")[0], depth=False, mask=False)


@pytest.mark.parametrize("content", [None, b"no array", npy(np.array(["far"]))])
def test_an_array_of_depth_that_cannot_be_read_is_named(tmp_path: Path, shots: list[Any], content: bytes | None) -> None:
    write(tmp_path / "a", shots, INTRINSICS, lambda n, shot: {"depth_file_path": "depth.npy"})
    if content is not None:
        (tmp_path / "a" / "depth.npy").write_bytes(content)
    with pytest.raises(InvalidInput, match="cannot be read as numpy's array of depth") as caught:
        load_burst(transforms.find_sequences(tmp_path / "a")[0])
    assert caught.value.field == str(tmp_path / "a" / "depth.npy")


def test_linked_folders_are_followed_once(tmp_path: Path, shots: list[Any]) -> None:
    write(tmp_path / "cup" / "blue", shots, INTRINSICS, lambda n, shot: {})
    chosen = tmp_path / "chosen"
    chosen.mkdir()
    (chosen / "cup").symlink_to(tmp_path / "cup")
    (tmp_path / "cup" / "up").symlink_to(tmp_path)
    assert [each.name for each in transforms.find_sequences(chosen)] == ["cup/blue"]
