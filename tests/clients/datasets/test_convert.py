"""Recordings of another format in the data layout: every pixel, camera and true pose comes along."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from clients.datasets import co3d, folders, photographs
from clients.datasets.convert import convert
from core.errors import InvalidInput

from .co3d_format import label, write_annotations, write_sequence
from .conftest import CLOUD


@pytest.fixture
def source(tmp_path: Path, shots: list[Any]) -> list[folders.Sequence]:
    """A labelled sequence of CO3D."""
    root = tmp_path / "co3d"
    write_annotations(root, "cup", write_sequence(root, "cup", "1_2_3", shots, CLOUD, "ndc_isotropic"))
    label(root, "cup", "1_2_3", "1_2_3", np.eye(4))
    return co3d.find_sequences(root)


def test_all_that_was_read_is_read_again(source: list[folders.Sequence], tmp_path: Path, prove: Callable[..., None]) -> None:
    assert list(convert(source, tmp_path / "out")) == [tmp_path / "out" / "cup" / "1_2_3"]
    (written,) = folders.find_sequences(tmp_path / "out")
    prove(written)
    assert written.name == "cup/1_2_3"
    assert written.world_from_model is not None
    assert source[0].world_from_model is not None
    np.testing.assert_allclose(written.world_from_model.as_matrix(), source[0].world_from_model.as_matrix(), atol=1e-9)
    assert written.longest_side_m == pytest.approx(source[0].longest_side_m)
    assert written.images[0].read_bytes() == source[0].images[0].read_bytes()


def test_symmetries_come_along(source: list[folders.Sequence], tmp_path: Path) -> None:
    turned = replace(source[0], symmetries=(np.diag([-1.0, -1.0, 1.0]),))
    list(convert([turned], tmp_path / "out"))
    np.testing.assert_array_equal(folders.find_sequences(tmp_path / "out")[0].symmetries, turned.symmetries)


def test_photographs_have_no_cameras_there_either(tmp_path: Path, shots: list[Any]) -> None:
    (tmp_path / "mug" / "red").mkdir(parents=True)
    cv2.imwrite(str(tmp_path / "mug" / "red" / "a.bmp"), shots[0].rgb[..., ::-1])
    list(convert(photographs.find_sequences(tmp_path / "mug"), tmp_path / "out"))
    (written,) = folders.find_sequences(tmp_path / "out")
    np.testing.assert_array_equal(folders.load_burst(written).views[0].rgb, shots[0].rgb)
    assert not (written.path / "scene_camera.json").exists()
    assert "model_scale_mm" not in json.loads((written.path / "sequence.json").read_text())


def test_nothing_is_written_over(source: list[folders.Sequence], tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="not empty"):
        list(convert(source, tmp_path))
    with pytest.raises(InvalidInput, match=r"two sequences are called cup/1_2_3"):
        list(convert(source * 2, tmp_path / "out"))
