"""The samples and the reader of their layout: conventions proven by reprojection."""

from __future__ import annotations

import json
import os
import shutil
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clients.datasets.folders import Sequence, find_sequences, load_burst
from clients.datasets.images import read_rgb, write_image
from core.errors import InvalidInput


def test_samples_are_enough_for_the_demo(recordings: list[Sequence]) -> None:
    instances = Counter(sequence.category for sequence in recordings)
    assert len(instances) >= 5
    assert len(recordings) >= 14
    assert min(instances.values()) >= 2
    assert min(len(sequence.images) for sequence in recordings) >= 10


def test_samples_are_small(recordings: list[Sequence]) -> None:
    root = recordings[0].path.parents[1]
    assert sum(file.stat().st_size for file in root.rglob("*") if file.is_file()) < 8_000_000


def test_the_true_box_projects_around_the_silhouette(recordings: list[Sequence]) -> None:
    """K, extrinsics, model pose and the shrunk images agree: a wrong half pixel would not show, a wrong convention would."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / (2 * np.sqrt(3))
    for sequence in recordings:
        view = load_burst(sequence, [0], masks=True).views[0]
        assert view.mask is not None
        assert view.camera is not None
        assert sequence.world_from_model is not None
        rows, columns = np.nonzero(view.mask)
        center, depth = view.camera.project(sequence.world_from_model.translation)
        assert columns.min() < center[0] < columns.max(), sequence.name
        assert rows.min() < center[1] < rows.max(), sequence.name
        cube, _ = view.camera.project(sequence.world_from_model.apply(corners))
        assert np.ptp(cube, axis=0).max() > 0.5 * max(np.ptp(columns), np.ptp(rows)), sequence.name
        assert view.depth_m is not None
        measured = view.depth_m[view.mask & (view.depth_m > 0)]
        assert abs(np.median(measured) - depth) < sequence.world_from_model.scale / 2, sequence.name


def test_points_on_the_object_agree_between_views(recordings: list[Sequence]) -> None:
    """Depth under the silhouette, back-projected, lies inside the model's unit ball."""
    for sequence in recordings:
        view = load_burst(sequence, [0], masks=True).views[0]
        assert view.camera is not None
        assert view.depth_m is not None
        assert view.mask is not None
        assert sequence.world_from_model is not None
        rows, columns = np.nonzero(view.mask & (view.depth_m > 0))
        points = view.camera.back_project(np.stack([columns, rows], axis=-1), view.depth_m[rows, columns])
        distances = np.linalg.norm(sequence.world_from_model.inverse().apply(points), axis=1)
        assert np.quantile(distances, 0.9) < 0.55, sequence.name


def test_masks_are_given_only_when_asked_for(recordings: list[Sequence]) -> None:
    assert load_burst(recordings[0], [0]).views[0].mask is None


def test_a_view_without_a_camera_keeps_its_silhouette(recordings: list[Sequence], tmp_path: Path) -> None:
    folder = tmp_path / "object"
    shutil.copytree(recordings[0].path, folder)
    (folder / "scene_camera.json").write_text("{}")
    view = load_burst(find_sequences(tmp_path)[0], [0], masks=True).views[0]
    assert view.camera is None
    assert view.mask is not None


def test_a_folder_without_sequences_is_named(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"sequence\.json.* where it holds a transforms\.json"):
        find_sequences(tmp_path)


def edit(file: str, change: Callable[[Any], object]) -> Callable[[Path], object]:
    """Of a copied recording: what `change` does to what a file of it holds."""

    def edited(folder: Path) -> None:
        content = json.loads((folder / file).read_text())
        change(content)
        (folder / file).write_text(json.dumps(content))

    return edited


@pytest.mark.parametrize(
    ("damage", "field", "says"),
    [
        (lambda folder: (folder / "sequence.json").write_text("{"), "sequence.json", "is not JSON"),
        (lambda folder: (folder / "sequence.json").write_text("[]"), "sequence.json", "expected a JSON object"),
        (edit("sequence.json", lambda about: about.pop("category")), "sequence.json: category", "expected a name, found None"),
        (edit("sequence.json", lambda about: about.pop("model_scale_mm")), "sequence.json: model_scale_mm", "expected a number"),
        (edit("sequence.json", lambda about: about.update(longest_side_mm="long")), "sequence.json: longest_side_mm", "expected a number"),
        (lambda folder: shutil.rmtree(folder / "rgb"), "", "has no folder rgb"),
        (
            lambda folder: (folder / "rgb" / "000000.jpg").rename(folder / "rgb" / "left.jpg"),
            "rgb/left.jpg",
            "expected a number for a name, such as 000000.jpg",
        ),
        (edit("scene_camera.json", lambda cameras: cameras["0"]["cam_K"].pop()), "scene_camera.json: 0.cam_K", "expected 9 numbers"),
        (
            edit("scene_camera.json", lambda cameras: cameras["1"].pop("depth_scale")),
            "scene_camera.json: 1.depth_scale",
            "expected a number",
        ),
        (edit("scene_camera.json", lambda cameras: cameras.update({"0": 5})), "scene_camera.json: 0.cam_R_w2c", "expected 9 numbers"),
        (edit("scene_camera.json", lambda cameras: cameras.update({"1": [5]})), "scene_camera.json: 1.depth_scale", r"found \[5\]"),
        (edit("scene_gt.json", lambda truth: truth.update({"0": truth["0"][0]})), "scene_gt.json: 0", "expected a list"),
        (edit("sequence.json", lambda about: about.update(symmetries=4)), "sequence.json: symmetries", "expected a list, found 4"),
        (lambda folder: [image.unlink() for image in (folder / "rgb").iterdir()], "", "has no folder rgb with images"),
        (
            lambda folder: write_image(folder / "depth" / "000001.png", np.ones((40, 40), np.uint16)),
            "rgb/000001.jpg: depth",
            "align depth to colour",
        ),
    ],
)
def test_what_is_wrong_with_a_recording_is_named(
    recordings: list[Sequence], tmp_path: Path, damage: Callable[[Path], object], field: str, says: str
) -> None:
    folder = shutil.copytree(recordings[0].path, tmp_path / "copy")
    damage(folder)
    with pytest.raises(InvalidInput, match=says) as caught:
        load_burst(find_sequences(folder)[0])
    assert caught.value.field == str(folder / field)


@pytest.mark.parametrize(("content", "says"), [(None, "is no file"), (b"", "is empty"), (b"text", "cannot be decoded")])
def test_an_image_that_cannot_be_read_is_named(tmp_path: Path, content: bytes | None, says: str) -> None:
    path = tmp_path / "000000.jpg"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InvalidInput, match=f"{says}; expected an image"):
        read_rgb(path)


def test_images_without_cameras_may_have_any_name(recordings: list[Sequence], tmp_path: Path) -> None:
    folder = shutil.copytree(recordings[0].path, tmp_path / "copy")
    for file in ("scene_camera.json", "scene_gt.json"):
        (folder / file).unlink()
    (folder / "rgb" / "000000.jpg").rename(folder / "rgb" / "left.jpg")
    (sequence,) = find_sequences(folder)
    assert {view.camera for view in load_burst(sequence).views} == {None}


QUARTER_TURN = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
BOP_QUARTER_TURN = [0.0, -1, 0, 5, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
"""As `symmetries_discrete` of BOP's models_info.json: 4×4, row by row, with a translation in millimetres."""


def with_symmetries(sequence: Sequence, folder: Path, symmetries: object) -> Path:
    """A copy of a sample that says it has these symmetries."""
    copy = shutil.copytree(sequence.path, folder / "copy")
    about = json.loads((copy / "sequence.json").read_text())
    (copy / "sequence.json").write_text(json.dumps(about | {"symmetries": symmetries}))
    return copy


@pytest.mark.parametrize(
    "symmetry", [QUARTER_TURN, np.ravel(QUARTER_TURN).tolist(), BOP_QUARTER_TURN, np.reshape(BOP_QUARTER_TURN, (4, 4)).tolist()]
)
def test_a_symmetry_is_read_in_either_form(recordings: list[Sequence], tmp_path: Path, symmetry: object) -> None:
    (sequence,) = find_sequences(with_symmetries(recordings[0], tmp_path, [symmetry]))
    np.testing.assert_array_equal(sequence.symmetries, [QUARTER_TURN])


@pytest.mark.parametrize(
    ("symmetry", "says"),
    [
        ([1.0, 0.0, 0.0, 0.0], "expected a rotation as 9 numbers"),
        ([[1.0, 0.0], [0.0]], "expected a rotation as 9 numbers"),
        ("z", "expected a rotation as 9 numbers"),
        ([None] * 9, "expected a rotation as 9 numbers"),
        (np.ravel(2 * np.eye(3)).tolist(), "is not a rotation"),
    ],
)
def test_a_symmetry_that_is_none_is_named(recordings: list[Sequence], tmp_path: Path, symmetry: object, says: str) -> None:
    folder = with_symmetries(recordings[0], tmp_path, [QUARTER_TURN, symmetry])
    with pytest.raises(InvalidInput, match=says) as caught:
        find_sequences(folder)
    assert caught.value.field == f"{folder / 'sequence.json'}: symmetries[1]"


def test_linked_folders_are_followed_once(recordings: list[Sequence], tmp_path: Path) -> None:
    chosen = tmp_path / "chosen"
    chosen.mkdir()
    (chosen / "category").symlink_to(recordings[0].path.parent, target_is_directory=True)
    (chosen / "again").symlink_to(recordings[0].path, target_is_directory=True)
    (chosen / "up").symlink_to(os.pardir, target_is_directory=True)
    found = find_sequences(chosen)
    assert sorted(sequence.name for sequence in found) == [each.name for each in recordings if each.category == recordings[0].category]
    assert all(load_burst(sequence, [0]).views for sequence in found)
