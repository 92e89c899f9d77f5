"""CO3D, both versions: folders in its published format, written here, and read back."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from clients.datasets import co3d
from clients.datasets.folders import load_burst
from clients.pose_error import pose_error
from core.errors import InvalidInput
from core.sim3 import Sim3

from .co3d_format import label, write_annotations, write_sequence
from .conftest import BALL, CLOUD, SIZE

LABEL = np.array([[0.0, -1, 0, 0.2], [1, 0, 0, -0.1], [0, 0, 1, 0.3], [0, 0, 0, 1]])
"""A quarter turn about z and a shift, from the world of sequence 1_2_3 to that of 4_5_6."""


@pytest.fixture(params=["ndc_norm_image_bounds", "ndc_isotropic"], ids=["version 1", "version 2"])
def root(request: pytest.FixtureRequest, tmp_path: Path, shots: list[Any]) -> Path:
    """A data set of one category with two sequences."""
    names = ("1_2_3", "4_5_6")
    write_annotations(
        tmp_path, "cup", [each for name in names for each in write_sequence(tmp_path, "cup", name, shots, CLOUD, request.param)]
    )
    return tmp_path


def test_points_project_to_where_the_images_have_them(root: Path, prove: Callable[..., None]) -> None:
    first, second = co3d.find_sequences(root)
    assert [first.name, second.name] == ["cup/1_2_3", "cup/4_5_6"]
    prove(first)
    assert first.world_from_model is None


def test_masks_are_given_only_when_asked_for(root: Path) -> None:
    assert load_burst(co3d.find_sequences(root)[0], [0]).views[0].mask is None


def test_labels_take_the_reference_to_another_sequence(root: Path) -> None:
    label(root, "cup", "1_2_3", "1_2_3", np.eye(4))
    label(root, "cup", "4_5_6", "1_2_3", LABEL)
    first, second = co3d.find_sequences(root)
    assert first.world_from_model is not None
    assert second.world_from_model is not None
    np.testing.assert_allclose(first.world_from_model.translation, BALL, atol=0.01)
    second_from_first = second.world_from_model @ first.world_from_model.inverse()
    np.testing.assert_allclose(second_from_first.as_matrix(), LABEL, atol=1e-9)
    assert first.world_from_model.scale == pytest.approx(np.linalg.norm([0.2, 0.4, 0.6]), rel=0.05)
    assert first.longest_side_m == pytest.approx(0.6, rel=0.03)


def test_a_label_that_is_no_json_is_named(root: Path) -> None:
    label(root, "cup", "1_2_3", "1_2_3", np.eye(4))
    (file,) = (root / "class_labels" / "cup").iterdir()
    file.write_text("{")
    with pytest.raises(InvalidInput, match="is not JSON") as caught:
        co3d.find_sequences(root)
    assert caught.value.field == str(file)


def test_only_labelled_sequences_are_taken_where_there_are_labels(root: Path) -> None:
    label(root, "cup", "4_5_6", "1_2_3", np.eye(4))
    assert [each.instance for each in co3d.find_sequences(root)] == ["4_5_6"]


def test_a_sequence_without_a_reference_cloud_has_no_truth(root: Path) -> None:
    label(root, "cup", "4_5_6", "1_2_3", LABEL)
    (root / "cup" / "1_2_3" / "pointcloud.ply").unlink()
    (sequence,) = co3d.find_sequences(root)
    assert sequence.world_from_model is None


def test_frames_that_were_not_downloaded_are_left_out(root: Path) -> None:
    (root / "cup" / "1_2_3" / "images" / "frame000002.jpg").unlink()
    assert [path.stem for path in co3d.find_sequences(root)[0].images] == ["frame000001", "frame000003"]


def test_long_sequences_are_thinned_evenly(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(co3d, "MAX_VIEWS", 2)
    assert [path.stem for path in co3d.find_sequences(root)[0].images] == ["frame000001", "frame000003"]


def test_depth_is_half_precision_floats_in_sixteen_bits() -> None:
    """1.0 is 0x3C00, 0.5 is 0x3800, infinity 0x7C00; each times the adjustment."""
    units = np.array([[0x3C00, 0x3800], [0x7C00, 0]], np.uint16)
    np.testing.assert_array_equal(co3d.decode_depth(units, 4.0), np.array([[4.0, 2.0], [0, 0]], np.float32))


def test_a_smaller_depth_image_is_brought_to_the_images_size(root: Path) -> None:
    for folder, suffix in (("depths", ".jpg.geometric.png"), ("depth_masks", ".png")):
        path = str(root / "cup" / "1_2_3" / folder / f"frame000001{suffix}")
        cv2.imwrite(path, cv2.imread(path, cv2.IMREAD_UNCHANGED)[::2, ::2])
    view = load_burst(co3d.find_sequences(root)[0], [0]).views[0]
    assert view.depth_m is not None
    assert view.depth_m.shape == SIZE


def test_the_cache_of_encodings_notices_other_cameras(root: Path) -> None:
    sequence = co3d.find_sequences(root)[0]
    assert all(path.exists() and path.is_relative_to(sequence.path) for path in sequence.reader.files(sequence))
    assert '"focal_length"' in sequence.reader.cameras(sequence)


def test_the_cache_of_encodings_notices_which_depth_is_consistent(root: Path) -> None:
    files = co3d.find_sequences(root)[0]
    read = {path.relative_to(root / "cup" / "1_2_3").parts[0] for path in files.reader.files(files)}
    assert read == {"images", "depths", "depth_masks"}


def test_what_is_missing_or_broken_is_named(root: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    with pytest.raises(InvalidInput, match=r"frame_annotations\.jgz"):
        co3d.find_sequences(tmp_path_factory.mktemp("empty"))
    label(root, "cup", "7_8_9", "1_2_3", np.eye(4))
    with pytest.raises(InvalidInput, match="class_labels"):
        co3d.find_sequences(root)
    (root / "cup" / "frame_annotations.jgz").write_bytes(b"no gzip")
    with pytest.raises(InvalidInput, match="download it again"):
        co3d.find_sequences(root)


def test_an_image_of_another_size_than_annotated_is_named(root: Path) -> None:
    path = root / "cup" / "1_2_3" / "images" / "frame000001.jpg"
    cv2.imwrite(str(path), np.zeros((40, 64, 3), np.uint8))
    with pytest.raises(InvalidInput, match="its annotation says"):
        load_burst(co3d.find_sequences(root)[0], [0])


def test_a_labels_rotation_must_be_one(root: Path) -> None:
    label(root, "cup", "1_2_3", "1_2_3", np.diag([1.0, 2, 1, 1]))
    with pytest.raises(InvalidInput, match="rotation"):
        co3d.find_sequences(root)


def test_the_truth_scores_itself_as_perfect(root: Path) -> None:
    label(root, "cup", "1_2_3", "1_2_3", np.eye(4))
    label(root, "cup", "4_5_6", "1_2_3", LABEL)
    first, second = (each.world_from_model for each in co3d.find_sequences(root))
    assert first
    assert second
    error = pose_error(Sim3.from_matrix(LABEL), first, second)
    assert (error.rotation_deg, error.translation, error.log_scale) == pytest.approx((0, 0, 0), abs=1e-5)
