"""A running service with a fast backbone, and the sample bursts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from clients.answers.categories import Category
from clients.datasets.folders import Sequence, find_sequences, load_burst
from clients.robot import RobotClient
from clients.simulator.episode import Conduct, Episode, shuffled
from clients.simulator.pictures import fetch_pictures
from clients.simulator.replay import ReplaySubject
from clients.simulator.report import EpisodeRecord
from clients.simulator.summary import summarise
from core.backbones.base import Backbone, Features, shown_patches
from core.views import Burst
from service.settings import Settings

SAMPLES = Path(__file__).parents[1] / "data" / "bursts"
Serving = Callable[[Settings, Backbone], AbstractContextManager[str]]


class CentreBackbone:
    """Tokens are a patch's pixels, the foreground is a disc in the middle: sees the same view again, and no more."""

    name = "centre"
    patch_size = 4
    dim = 48
    has_saliency = True
    whitening = None
    fingerprint = "centre-1"

    def extract(self, images: NDArray[np.uint8]) -> Features:
        """See `Backbone.extract`."""
        views, side = images.shape[:2]
        grid = side // self.patch_size
        shown = shown_patches(images, self.patch_size).reshape(views, grid, grid)
        blocks = images[..., :3].reshape(views, grid, self.patch_size, grid, self.patch_size, 3).swapaxes(2, 3)
        tokens = (blocks.reshape(views, grid, grid, self.dim) / np.float32(255) * shown[..., None]).astype(np.float32)
        disc = np.zeros((side, side), np.float32)
        cv2.circle(disc, (side // 2, side // 2), round(0.35 * side), 1.0, -1)
        small = cv2.resize(disc, (grid, grid), interpolation=cv2.INTER_AREA)
        return Features(
            tokens,
            tokens.mean(axis=(1, 2)),
            small * shown.astype(np.float32),
            disc * shown.repeat(self.patch_size, axis=1).repeat(self.patch_size, axis=2).astype(np.float32),
        )


@pytest.fixture(scope="session")
def recordings() -> list[Sequence]:
    """The sample sequences."""
    return find_sequences(SAMPLES)


SERVICE: dict[str, Any] = {"score": "pooled_best_view", "threshold": 0.9999}
"""Settings of a service for which everything but an identical burst is novel."""


@pytest.fixture
def url(tmp_path: Path, serving: Serving) -> Iterator[str]:
    """The address of a service with an empty memory."""
    with serving(Settings(data_dir=tmp_path / "memory", **SERVICE), CentreBackbone()) as address:
        yield address


@pytest.fixture
def robot(url: str) -> Iterator[RobotClient]:
    """A client of that service."""
    with RobotClient(url) as client:
        yield client


@pytest.fixture
def burst(recordings: list[Sequence]) -> Burst:
    """Four views of a car."""
    return load_burst(recordings[0], range(4))


@pytest.fixture
def learnt(robot: RobotClient, burst: Burst) -> Category:
    """The category that it makes."""
    scan = robot.scan(burst, viewpoints=4, up=(0, 0, 1), standoff_m=1.0)
    assert len(scan) == 4
    for view in burst.views:
        scan.add(view)
    return scan.complete("car")


@pytest.fixture(scope="session")
def record(recordings: list[Sequence], serving: Serving, tmp_path_factory: pytest.TempPathFactory) -> EpisodeRecord:
    """An episode: one object twice from the same sides, which the backbone recognises, and another of its category, which it does not."""
    memory = tmp_path_factory.mktemp("episode") / "memory"
    with serving(Settings(data_dir=memory, **SERVICE), CentreBackbone()) as address, RobotClient(address) as robot:
        subjects = shuffled([ReplaySubject(recordings[index]) for index in (0, 0, 1)], seed=1)
        encounters = list(Episode(robot, subjects, Conduct(views=12, seed=1)))
        pictures = {index: fetch_pictures(robot, encounter) for index, encounter in enumerate(encounters)}
        settings = {"seed": 1, "views": 12}
        return EpisodeRecord(summarise(encounters, 9.0), encounters, pictures, robot.categories(), robot.info(), settings)
