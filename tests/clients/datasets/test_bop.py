"""BOP data sets: scenes in the published format, written here, and read back."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from clients.datasets import bop
from clients.datasets.folders import load_burst
from core.errors import InvalidInput

from .conftest import BALL

DEPTH_SCALE = 0.1
"""Millimetres a unit, as in several of the benchmark's data sets."""
MODEL = {
    "diameter": 600.0,
    "min_x": -300.0,
    "min_y": -200.0,
    "min_z": -100.0,
    "size_x": 600.0,
    "size_y": 400.0,
    "size_z": 200.0,
    "symmetries_discrete": [[-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]],
    "symmetries_continuous": [{"axis": [0, 0, 1], "offset": [0, 0, 0]}],
}


def write_scene(scene: Path, shots: list[Any], objects: list[int], *, posed: bool, images: str = "rgb") -> None:
    """A scene whose objects are all the ball, standing upright; the first one has the ball's silhouette."""
    cameras, truth = {}, {}
    for folder in (images, "depth", "mask_visib"):
        (scene / folder).mkdir(parents=True, exist_ok=True)
    for number, shot in enumerate(shots):
        pose = shot.camera.camera_from_world
        entry = {"cam_K": shot.camera.K.ravel().tolist(), "depth_scale": DEPTH_SCALE}
        if posed:
            entry |= {"cam_R_w2c": pose[:3, :3].ravel().tolist(), "cam_t_w2c": (1000 * pose[:3, 3]).tolist()}
        cameras[str(number)] = entry
        in_camera = 1000 * (pose[:3, :3] @ BALL + pose[:3, 3])
        truth[str(number)] = [
            {"cam_R_m2c": pose[:3, :3].ravel().tolist(), "cam_t_m2c": in_camera.tolist(), "obj_id": each} for each in objects
        ]
        rgb = shot.rgb[..., ::-1] if images == "rgb" else shot.rgb[..., 0]
        cv2.imwrite(str(scene / images / f"{number:06}.png"), rgb)
        cv2.imwrite(str(scene / "depth" / f"{number:06}.png"), np.round(1000 * shot.depth_m / DEPTH_SCALE).astype(np.uint16))
        for index in range(len(objects)):
            silhouette = shot.mask if index == 0 else ~shot.mask
            cv2.imwrite(str(scene / "mask_visib" / f"{number:06}_{index:06}.png"), silhouette.astype(np.uint8) * 255)
    (scene / "scene_camera.json").write_text(json.dumps(cameras))
    (scene / "scene_gt.json").write_text(json.dumps(truth))


@pytest.fixture
def root(tmp_path: Path, shots: list[Any]) -> Path:
    """A data set of one scene with one object."""
    write_scene(tmp_path / "test" / "000001", shots, [5], posed=True)
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "models_info.json").write_text(json.dumps({"5": MODEL}))
    return tmp_path


def test_points_project_to_where_the_images_have_them(root: Path, prove: Callable[..., None]) -> None:
    (sequence,) = bop.find_sequences(root)
    assert sequence.name == "000005/test-000001"
    prove(sequence)


def test_the_models_frame_has_its_box_at_the_middle_and_its_diagonal_as_unit(root: Path) -> None:
    (sequence,) = bop.find_sequences(root)
    assert sequence.world_from_model is not None
    np.testing.assert_allclose(sequence.world_from_model.translation, BALL, atol=1e-6)  # min + size / 2 is 0 here
    assert sequence.world_from_model.scale == pytest.approx(np.linalg.norm([0.6, 0.4, 0.2]))
    assert sequence.longest_side_m == pytest.approx(0.6)


def test_symmetries_are_rotations(root: Path) -> None:
    (sequence,) = bop.find_sequences(root)
    assert len(sequence.symmetries) == 1 + 71
    np.testing.assert_allclose(sequence.symmetries[0], np.diag([-1, -1, 1]))
    fifth_degree = np.array([[np.cos(np.pi / 36), -np.sin(np.pi / 36), 0], [np.sin(np.pi / 36), np.cos(np.pi / 36), 0], [0, 0, 1]])
    np.testing.assert_allclose(sequence.symmetries[1], fifth_degree, atol=1e-12)


def test_the_object_is_the_world_where_cameras_have_no_pose(tmp_path: Path, shots: list[Any]) -> None:
    write_scene(tmp_path, shots, [1], posed=False)
    (sequence,) = bop.find_sequences(tmp_path)
    for view, shot in zip(load_burst(sequence).views, shots, strict=True):
        assert view.camera is not None
        np.testing.assert_allclose(view.camera.project(np.zeros(3))[0], shot.camera.project(BALL)[0], atol=1e-6)
    assert sequence.world_from_model is None  # there is no models_info.json


def test_each_object_of_a_scene_is_a_sequence_with_its_silhouette(tmp_path: Path, shots: list[Any]) -> None:
    write_scene(tmp_path, shots, [5, 2], posed=True)
    second, first = bop.find_sequences(tmp_path)
    assert [first.category, second.category] == ["000005", "000002"]
    np.testing.assert_array_equal(load_burst(first).views[0].mask, shots[0].mask)
    np.testing.assert_array_equal(load_burst(second).views[0].mask, ~shots[0].mask)


def test_two_copies_of_an_object_are_two_sequences(tmp_path: Path, shots: list[Any]) -> None:
    write_scene(tmp_path / "scene", shots, [7, 7], posed=True)
    assert [each.name for each in bop.find_sequences(tmp_path)] == ["000007/scene-0", "000007/scene-1"]


def test_grey_scenes_are_read(tmp_path: Path, shots: list[Any]) -> None:
    write_scene(tmp_path, shots, [1], posed=True, images="gray")
    assert load_burst(bop.find_sequences(tmp_path)[0]).views[0].rgb.shape == (48, 64, 3)


def test_linked_folders_are_followed_once(root: Path) -> None:
    (root / "test" / "up").symlink_to(root)
    assert [each.name for each in bop.find_sequences(root)] == ["000005/test-000001"]


@pytest.mark.parametrize(
    ("file", "change", "field"),
    [
        ("scene_gt.json", lambda scene: scene["0"][0].pop("cam_t_m2c"), "0[0].cam_t_m2c"),
        ("scene_gt.json", lambda scene: scene["0"][0]["cam_R_m2c"].pop(), "0[0].cam_R_m2c"),
        ("scene_camera.json", lambda scene: scene["0"].pop("depth_scale"), "0.depth_scale"),
        ("scene_camera.json", lambda scene: scene.update({"0": 7}), "0.cam_K"),
        ("scene_gt.json", lambda scene: scene["0"][0].pop("obj_id"), "0[0].obj_id"),
    ],
)
def test_what_is_wrong_with_a_scene_is_named(root: Path, file: str, change: Callable[[Any], object], field: str) -> None:
    path = root / "test" / "000001" / file
    scene = json.loads(path.read_text())
    change(scene)
    path.write_text(json.dumps(scene))
    with pytest.raises(InvalidInput, match="expected .*number") as caught:
        load_burst(bop.find_sequences(root)[0])
    assert caught.value.field == f"{path}: {field}"


@pytest.mark.parametrize(
    ("change", "field"),
    [
        (lambda models: models["5"].pop("size_y"), "5.size_y"),
        (lambda models: models["5"].update(min_x=None), "5.min_x"),
        (lambda models: models["5"].update(symmetries_continuous=[{"offset": [0, 0, 0]}]), "5.symmetries_continuous.axis"),
    ],
)
def test_what_is_wrong_with_a_model_is_named(root: Path, change: Callable[[Any], object], field: str) -> None:
    path = root / "models" / "models_info.json"
    models = json.loads(path.read_text())
    change(models)
    path.write_text(json.dumps(models))
    with pytest.raises(InvalidInput, match="expected .*number") as caught:
        bop.find_sequences(root)
    assert caught.value.field == f"models_info.json: {field}"


def test_an_image_without_a_number_is_named(root: Path) -> None:
    images = root / "test" / "000001" / "rgb"
    (images / "000000.png").rename(images / "first.png")
    with pytest.raises(InvalidInput, match="expected a number for a name") as caught:
        bop.find_sequences(root)
    assert caught.value.field == str(images / "first.png")


def test_a_folder_without_scenes_is_named(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"scene_gt\.json"):
        bop.find_sequences(tmp_path)
