"""Bursts come back from their image files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from core.errors import Unavailable
from core.views import Burst, View
from store.bursts import read_burst, read_view, write_burst
from store.folders import sums


def test_colour_cameras_and_masks_come_back_exactly(tmp_path: Path, burst: Burst) -> None:
    write_burst(tmp_path, burst)
    for found, written in zip(read_burst(tmp_path, sums(tmp_path)).views, burst.views):
        assert np.array_equal(found.rgb, written.rgb)
        assert np.array_equal(found.mask, written.mask)
        assert np.array_equal(found.camera.K, written.camera.K)
        assert np.array_equal(found.camera.world_from_camera, written.camera.world_from_camera)


def test_depth_comes_back_to_a_tenth_of_a_millimetre(tmp_path: Path, burst: Burst) -> None:
    write_burst(tmp_path, burst)
    for found, written in zip(read_burst(tmp_path, sums(tmp_path)).views, burst.views):
        assert np.abs(found.depth_m - written.depth_m).max() <= 0.00005 + 1e-6


def test_depth_beyond_the_usual_range_is_kept_more_coarsely(tmp_path: Path, burst: Burst) -> None:
    far = replace(burst.views[0], depth_m=np.linspace(20, 40, 32 * 40, dtype=np.float32).reshape(32, 40))
    write_burst(tmp_path, Burst([far]))
    assert np.allclose(read_view(tmp_path, sums(tmp_path), 0).depth_m, far.depth_m, atol=0.0004)


def test_a_view_of_colour_alone_comes_back_as_such(tmp_path: Path, burst: Burst) -> None:
    write_burst(tmp_path, Burst([View(burst.views[0].rgb)]))
    found = read_view(tmp_path, sums(tmp_path), 0)
    assert (found.depth_m, found.camera, found.mask) == (None, None, None)


def test_a_missing_image_is_named(tmp_path: Path, burst: Burst) -> None:
    write_burst(tmp_path, burst)
    files = sums(tmp_path)
    (tmp_path / "001_depth.png").unlink()
    with pytest.raises(Unavailable, match=r"001_depth\.png"):
        read_burst(tmp_path, files)


@pytest.mark.parametrize("name", ["001_depth.png", "002_rgb.png", "000_mask.png", "cameras.json"])
def test_a_damaged_file_is_named_before_anything_is_made_of_it(tmp_path: Path, burst: Burst, name: str) -> None:
    write_burst(tmp_path, burst)
    files = sums(tmp_path)
    content = bytearray((tmp_path / name).read_bytes())
    content[len(content) // 2] ^= 1
    for damaged in (bytes(content), bytes(content[: len(content) // 3]), b""):
        (tmp_path / name).write_bytes(damaged)
        with pytest.raises(Unavailable, match=rf"{name} is damaged"):
            read_burst(tmp_path, files)


def test_a_file_that_never_was_written_is_named(tmp_path: Path, burst: Burst) -> None:
    write_burst(tmp_path, burst)
    files = sums(tmp_path)
    del files["002_mask.png"]
    with pytest.raises(Unavailable, match=r"002_mask\.png is missing from the memory"):
        read_burst(tmp_path, files)


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path, burst: Burst) -> None:
    write_burst(tmp_path, burst)
    files = sums(tmp_path)
    (tmp_path / "001_rgb.png").unlink()
    (tmp_path / "001_rgb.png").mkdir()
    with pytest.raises(Unavailable, match=r"001_rgb\.png cannot be read"):
        read_burst(tmp_path, files)


def test_a_file_that_is_no_picture_though_it_is_what_was_written_is_named(tmp_path: Path, burst: Burst) -> None:
    write_burst(tmp_path, burst)
    (tmp_path / "001_rgb.png").write_bytes(b"no picture")
    with pytest.raises(Unavailable, match=r"001_rgb\.png is no picture"):
        read_burst(tmp_path, sums(tmp_path))
