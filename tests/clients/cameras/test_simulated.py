"""A recorded folder as a camera."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clients.cameras.simulated import recorded
from clients.datasets.folders import Sequence, load_burst
from core.errors import InvalidInput


def test_it_answers_with_the_nearest_recorded_view(recordings: list[Sequence]) -> None:
    burst = load_burst(recordings[0])
    camera = recorded(recordings[0].path)
    for index in (3, 0):
        view = camera.look(burst.cameras[index].world_from_camera)
        np.testing.assert_array_equal(view.rgb, burst.views[index].rgb)


def test_it_plays_one_object(recordings: list[Sequence]) -> None:
    with pytest.raises(InvalidInput, match="holds 3 objects; name one"):
        recorded(recordings[0].path.parent)


def test_photographs_cannot_be_played(recordings: list[Sequence]) -> None:
    with pytest.raises(InvalidInput, match="needs K and world_from_camera"):
        recorded(f"images:{recordings[0].path / 'rgb'}")


def test_a_folder_that_is_none_is_named(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"is no folder"):
        recorded(tmp_path / "none")
