"""Rendered recordings: what was written is what the reader of the data layout finds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clients.datasets.folders import find_sequences, load_burst
from clients.simulator.raycast.export import contact_sheet, draw_models, export
from clients.simulator.raycast.model import Model
from clients.simulator.raycast.sensor import SensorConfig
from core.errors import InvalidInput


def test_a_recording_reads_back_with_its_ground_truth(brick: Model, small: SensorConfig, tmp_path: Path) -> None:
    (folder,) = export([brick], 3, tmp_path / "out", seed=0, sensor=small)
    (sequence,) = find_sequences(tmp_path / "out")
    assert (sequence.path, sequence.name) == (folder, "brick/brick_0")
    assert sequence.world_from_model is not None
    assert sequence.world_from_model.scale == pytest.approx(brick.size_m)
    burst = load_burst(sequence, masks=True)
    corners = sequence.world_from_model.apply(brick.mesh.vertices)
    for view in burst.views:
        assert view.camera is not None
        assert view.mask is not None
        assert view.depth_m is not None
        pixels, _ = view.camera.project(corners)
        rows, columns = np.nonzero(view.mask)
        np.testing.assert_allclose(pixels.min(axis=0), [columns.min(), rows.min()], atol=1.5)
        np.testing.assert_allclose(pixels.max(axis=0), [columns.max(), rows.max()], atol=1.5)
        measured = view.mask & (view.depth_m > 0)
        points = view.camera.back_project(np.argwhere(measured)[:, ::-1].astype(float), view.depth_m[measured])
        inside = sequence.world_from_model.inverse().apply(points)
        low, high = brick.mesh.bounds
        assert (inside > low - 0.01).all()
        assert (inside < high + 0.01).all()
    contact_sheet([folder], 2, tmp_path / "sheet.jpg")
    assert (tmp_path / "sheet.jpg").stat().st_size > 1000


def test_objects_are_drawn_by_category_and_seed() -> None:
    names = [model.name for model in draw_models(["mug", "bottle"], 2, seed=3)]
    assert names == ["mug/mug_6", "mug/mug_7", "bottle/bottle_6", "bottle/bottle_7"]
    with pytest.raises(InvalidInput, match="is none of aeroplane"):
        draw_models(["unicorn"], 1, seed=0)


def test_a_used_folder_is_refused(brick: Model, tmp_path: Path) -> None:
    (tmp_path / "something").touch()
    with pytest.raises(InvalidInput, match="not empty"):
        next(export([brick], 1, tmp_path, seed=0))
