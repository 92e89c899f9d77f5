"""Benchmarks on CO3D's published format: the paper's evaluation, on two objects whose pose is known, and isolation against its masks."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks import isolation, pose
from benchmarks.contenders import Sweep
from core.camera_poses import hemisphere
from core.sim3 import Sim3

from ..clients.datasets.co3d_format import label, write_annotations, write_sequence
from .conftest import HALF_AXES

REFERENCE = Sim3(6.0, np.eye(3), np.array([0.3, -0.2, 0.5]))
"""CO3D's objects are about six units large."""
TARGET_FROM_REFERENCE = Sim3(1.0, np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.array([0.4, 0.1, -0.2]))


def sequence(root: Path, name: str, egg: Any, world_from_model: Sim3) -> list[dict[str, Any]]:
    poses = hemisphere(world_from_model.translation, np.array([0.0, 0.0, 1.0]), 3 * world_from_model.scale, 4)
    views = [egg.view(world_from_model, pose) for pose in poses]
    shots = [SimpleNamespace(camera=view.camera, rgb=view.rgb, depth_m=view.depth_m, mask=view.depth_m > 0) for view in views]
    directions = np.random.default_rng(0).normal(size=(3000, 3))
    surface = HALF_AXES * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return write_sequence(root, "egg", name, shots, world_from_model.apply(surface), "ndc_isotropic")


def test_labelled_sequences_are_estimated_and_translations_scored_in_the_papers_unit(
    tmp_path: Path, ellipsoid: Any, small_world: Any
) -> None:
    small_world(pose)
    root, egg = tmp_path / "co3d", ellipsoid(HALF_AXES)
    frames = sequence(root, "1_1_1", egg, REFERENCE) + sequence(root, "2_2_2", egg, TARGET_FROM_REFERENCE @ REFERENCE)
    write_annotations(root, "egg", frames)
    label(root, "egg", "1_1_1", "1_1_1", np.eye(4))
    label(root, "egg", "2_2_2", "1_1_1", TARGET_FROM_REFERENCE.as_matrix())
    row, _ = pose.run(Path(f"co3d:{root}"), Sweep(["ucd"], ["4"]), 2, None, seed=0, backbone="colour")
    assert (row.category, row.pairs, row.acc7_5) == ("egg", 2, 100)
    longest = 6.0 * 2 * HALF_AXES.max()
    diagonals = row.median_t * np.linalg.norm(6.0 * 2 * HALF_AXES) / longest * 2 * np.pi
    assert row.median_t_2pi == pytest.approx(diagonals, rel=0.1)
    assert row.acc_t0_5 == 100


def test_isolation_is_scored_against_its_masks(tmp_path: Path, ellipsoid: Any, small_world: Any) -> None:
    small_world(isolation)
    write_annotations(tmp_path / "co3d", "egg", sequence(tmp_path / "co3d", "1_1_1", ellipsoid(HALF_AXES), REFERENCE))
    *_, everything = isolation.run(Path(f"co3d:{tmp_path / 'co3d'}"), None, ["saliency"], limit=None, backbone="colour")
    assert everything.views == 4
