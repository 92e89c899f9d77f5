"""Plain folders of images."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from clients.datasets import photographs
from clients.datasets.folders import load_burst
from core.errors import InvalidInput


def test_each_folder_of_images_is_a_sequence_of_the_folder_around_it(tmp_path: Path, shots: list[Any]) -> None:
    for name in ("mug/red", "mug/blue", "pen/old"):
        (tmp_path / name).mkdir(parents=True)
        for number, shot in enumerate(shots):
            cv2.imwrite(str(tmp_path / name / f"IMG_{number}.PNG"), shot.rgb[..., ::-1])
    (tmp_path / "mug" / "notes.txt").write_text("no image")
    sequences = photographs.find_sequences(tmp_path)
    assert [each.name for each in sequences] == ["mug/blue", "mug/red", "pen/old"]
    burst = load_burst(sequences[0])
    np.testing.assert_array_equal(burst.views[1].rgb, shots[1].rgb)
    assert burst.views[0].camera is None
    assert burst.views[0].depth_m is None


def test_linked_folders_are_followed_once(tmp_path: Path, shots: list[Any]) -> None:
    (tmp_path / "mug" / "red").mkdir(parents=True)
    cv2.imwrite(str(tmp_path / "mug" / "red" / "0.png"), shots[0].rgb)
    (tmp_path / "mug" / "up").symlink_to(tmp_path)
    assert [each.name for each in photographs.find_sequences(tmp_path)] == ["mug/red"]


def test_a_folder_without_images_is_named(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"CATEGORY/INSTANCE/\*\.jpg"):
        photographs.find_sequences(tmp_path)
