"""docs/camera.md does what it says, from a folder of somebody's own images to a pose."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from clients.cameras.base import Frame
from clients.datasets.folders import Sequence, load_burst

PAGE = (Path(__file__).parents[2] / "docs" / "camera.md").read_text()
READ, LEARN, MEET, LIVE = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
ADDRESS = "http://127.0.0.1:8000"


def write(folder: Path, sequence: Sequence) -> None:
    """A recording as the page lays it out."""
    for name in ("rgb", "depth", "pose"):
        (folder / name).mkdir(parents=True)
    views = load_burst(sequence).views
    np.savetxt(folder / "K.txt", views[0].camera.K)
    for index, (view, image) in enumerate(zip(views, sequence.images, strict=True)):
        shutil.copy(image, folder / "rgb" / f"{index:03}.jpg")
        cv2.imwrite(str(folder / "depth" / f"{index:03}.png"), np.round(1000 * view.depth_m).astype(np.uint16))
        np.savetxt(folder / "pose" / f"{index:03}.txt", view.camera.world_from_camera)


@pytest.fixture
def page(url: str, recordings: list[Sequence], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """page(block, …): runs blocks of the page, one after the other, beside two mugs; the names that they leave behind."""
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "my_mug", recordings[0])
    write(tmp_path / "another_mug", recordings[0])  # the backbone of these tests knows nothing but the very same again
    names: dict[str, Any] = {}

    def run(*blocks: str) -> SimpleNamespace:
        for block in blocks:
            exec(compile(block.replace(ADDRESS, url), "docs/camera.md", "exec"), names)
        return SimpleNamespace(**names)

    yield run
    names["robot"].close()


def test_a_folder_of_images_is_read_in_metres(page: Any, recordings: list[Sequence]) -> None:
    views, recorded = page(READ).views_of(Path("my_mug")), load_burst(recordings[0]).views
    assert len(views) == 12
    for view, right in zip(views, recorded, strict=True):
        np.testing.assert_array_equal(view.rgb, right.rgb)
        np.testing.assert_allclose(view.depth_m, right.depth_m, atol=0.0006)
        np.testing.assert_allclose(view.camera.world_from_camera, right.camera.world_from_camera, atol=1e-9)


def test_one_mug_is_learnt_and_another_one_met(page: Any, capsys: pytest.CaptureFixture[str]) -> None:
    ran = page(READ, LEARN, MEET)
    assert [(each.name, each.views) for each in ran.robot.categories()] == [("mug", 12)]
    assert (ran.seen.outcome, ran.seen.name) == ("known", "mug")
    assert "known mug\n[[" in capsys.readouterr().out


def test_a_live_camera_follows_it_in_its_own_frame(page: Any) -> None:
    ran = page(READ, LEARN, LIVE)
    view = ran.views[0]
    device = SimpleNamespace(grab=lambda: Frame(view.rgb, view.depth_m, view.camera.K))
    (tracked,) = islice(ran.follow(device, ran.robot.categories()[0].id), 1)
    assert tracked.pose is not None
    assert 0.2 < np.linalg.norm(tracked.pose.world_from_object[:3, 3]) < 3
