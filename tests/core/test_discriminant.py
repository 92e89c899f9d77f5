"""The directions kept are those that tell points apart, not those that change with the view."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core.descriptors import PcaBasis
from core.discriminant import discriminant_directions
from core.encode import EncodedView
from core.sim3 import Sim3

from .conftest import PaintedObject


def changing(views: tuple[EncodedView, ...], direction: np.ndarray, seed: int = 0) -> list[EncodedView]:
    """The views, with every token of each moved along one direction, differently from patch to patch and view to view."""
    rng = np.random.default_rng(seed)
    return [
        replace(view, descriptors=view.descriptors + rng.normal(scale=5, size=(len(view.cells), 1)).astype(np.float32) * direction)
        for view in views
    ]


def test_what_changes_with_the_view_is_left_out(painted: PaintedObject) -> None:
    direction = np.eye(48, dtype=np.float32)[7]
    views = changing(painted.encode(8).views, direction)
    principal = PcaBasis.fit(np.concatenate([view.descriptors for view in views])).components
    directions = discriminant_directions([views], 32)
    assert abs(principal[0] @ direction) > 0.99
    response = np.linalg.norm(directions, axis=1)
    assert response[7] == pytest.approx(1 / 5, rel=0.1)
    assert np.median(response) > 1


def test_what_the_target_changes_in_is_left_out_too(painted: PaintedObject, moved: Sim3) -> None:
    direction = np.eye(48, dtype=np.float32)[7]
    reference = list(painted.encode(8).views)
    target = changing(painted.encode(8, moved).views, direction)
    alone, together = (np.linalg.norm(discriminant_directions(each, 32), axis=1)[7] for each in ([reference], [reference, target]))
    assert together < 0.2 * alone


@pytest.mark.parametrize("views", [1, 2])
def test_few_or_no_points_seen_twice_still_give_directions(painted: PaintedObject, views: int) -> None:
    directions = discriminant_directions([painted.encode(views).views, []], 32)
    assert directions.shape == (48, 32)
    assert np.isfinite(directions).all()


def test_tokens_that_are_all_alike_give_finite_directions(painted: PaintedObject) -> None:
    views = [replace(view, descriptors=np.ones_like(view.descriptors)) for view in painted.encode(3).views]
    assert np.isfinite(discriminant_directions([views], 8)).all()
