"""The simulator's categories: unlimited, repeatable, different, and as symmetric as they say."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from clients.simulator.raycast.categories import RECIPES
from clients.simulator.raycast.mesh import Mesh, rotation_about
from clients.simulator.raycast.model import Model


@pytest.fixture(scope="module")
def models() -> dict[str, Model]:
    """The first object of each category."""
    return {category: recipe.make(category, 0) for category, recipe in RECIPES.items()}


def unlike(mesh: Mesh, rotation: np.ndarray) -> float:
    """Share of vertices that, turned, meet no vertex of about their place and colour."""
    points = mesh.vertices[::37]
    gap, nearest = cKDTree(mesh.vertices).query(points @ rotation.T)
    colour = np.abs(mesh.colours[nearest] - mesh.colours[::37]).max(axis=1)
    return float(((gap > 0.02) | (colour > 0.35)).mean())


def test_there_are_many(models: dict[str, Model]) -> None:
    assert len(models) >= 10
    assert sum(bool(model.symmetries) for model in models.values()) >= 3


def test_objects_are_of_unit_size_with_colours_in_range(models: dict[str, Model]) -> None:
    for name, model in models.items():
        low, high = model.mesh.bounds
        np.testing.assert_allclose(low, -high, atol=1e-9, err_msg=name)
        assert np.linalg.norm(high - low) == pytest.approx(1)
        assert model.mesh.colours.min() >= 0
        assert model.mesh.colours.max() <= 1
        assert 0.15 < model.size_m < 0.5
        assert model.mesh.triangles.max() < len(model.mesh.vertices)


@pytest.mark.parametrize("category", ["mug", "car", "bottle"])
def test_a_seed_makes_the_same_object_and_another_seed_another_one(category: str, models: dict[str, Model]) -> None:
    again, other = (RECIPES[category].make(category, seed) for seed in (0, 1))
    np.testing.assert_array_equal(again.mesh.vertices, models[category].mesh.vertices)
    np.testing.assert_array_equal(again.mesh.colours, models[category].mesh.colours)
    assert not np.array_equal(np.ptp(other.mesh.vertices, axis=0), np.ptp(again.mesh.vertices, axis=0))


@pytest.mark.parametrize("category", sorted(RECIPES))
def test_declared_symmetries_hold_and_others_do_not(category: str, models: dict[str, Model]) -> None:
    model = models[category]
    for symmetry in model.symmetries[:4]:
        assert unlike(model.mesh, symmetry) < 0.08
    declared = {round(float(np.degrees(np.arctan2(each[1, 0], each[0, 0])))) % 360 for each in model.symmetries}
    for angle in {90, 180, 270} - declared:
        assert unlike(model.mesh, rotation_about("z", angle)) > 0.1
