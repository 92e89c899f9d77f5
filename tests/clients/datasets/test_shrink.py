"""Small copies of a data folder."""

from __future__ import annotations

import random
import shutil
from pathlib import Path

import numpy as np
import pytest

from clients.datasets.folders import Sequence, find_sequences, load_burst
from clients.datasets.shrink import ShrinkConfig, draw, shrink
from core.errors import InvalidInput

TINY = ShrinkConfig(categories=1, instances=1, views=3, side=160)


def test_a_copy_keeps_geometry_and_ground_truth(recordings: list[Sequence], tmp_path: Path) -> None:
    names = shrink(recordings[0].path.parents[1], tmp_path / "small", TINY)
    small = find_sequences(tmp_path / "small")[0]
    original = next(sequence for sequence in recordings if [sequence.name] == names)
    assert small.world_from_model is not None
    assert original.world_from_model is not None
    point = original.world_from_model.translation
    np.testing.assert_allclose(small.world_from_model.as_matrix(), original.world_from_model.as_matrix(), atol=1e-6)
    larger = load_burst(original).views
    for view in load_burst(small).views:
        assert view.camera is not None
        assert view.depth_m is not None
        assert view.size == (160, 160)
        pose = view.camera.world_from_camera
        same = min(larger, key=lambda each: float(np.abs(each.camera.world_from_camera - pose).max()))  # type: ignore[union-attr]
        assert same.camera is not None
        assert same.depth_m is not None
        # Half the resolution: what is at x is at (x + 0.5) / 2 - 0.5, pixel centres being at integers.
        np.testing.assert_allclose(view.camera.project(point)[0], (same.camera.project(point)[0] + 0.5) / 2 - 0.5, atol=1e-3)
        step = 0.004 * np.median(same.depth_m[same.depth_m > 0])
        neighbours = np.stack([same.depth_m[row::2, column::2] for row in (0, 1) for column in (0, 1)])
        assert (np.abs(neighbours - view.depth_m).min(axis=0) <= 2 * step).all()


def test_recordings_without_truth_and_depth_are_copied_without(recordings: list[Sequence], tmp_path: Path) -> None:
    folder = shutil.copytree(recordings[0].path, tmp_path / "data" / "car" / "bare")
    (folder / "scene_gt.json").unlink()
    shutil.rmtree(folder / "depth")
    shrink(tmp_path / "data", tmp_path / "small", TINY)
    (small,) = find_sequences(tmp_path / "small")
    assert small.world_from_model is None
    assert [(view.depth_m, view.size) for view in load_burst(small).views] == [(None, (160, 160))] * 3


def test_the_draw_depends_on_the_seed_alone(recordings: list[Sequence]) -> None:
    config = ShrinkConfig(categories=3, instances=2)
    orders = [(recordings, 4), (recordings[::-1], 4), (recordings, 5)]
    names = [[each.name for each in draw(order, config, random.Random(seed))] for order, seed in orders]
    assert names[0] == names[1] != names[2]
    assert len(names[0]) == 6


def test_too_few_objects_and_a_used_folder_are_refused(recordings: list[Sequence], tmp_path: Path) -> None:
    data = recordings[0].path.parents[1]
    with pytest.raises(InvalidInput, match="3 objects or more; 50 are asked for"):
        shrink(data, tmp_path / "new", ShrinkConfig(categories=50))
    (tmp_path / "file").touch()
    with pytest.raises(InvalidInput, match="is not empty"):
        shrink(data, tmp_path, TINY)
