"""A running service with a fast backbone, and the sample bursts."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import pytest
import uvicorn
from numpy.typing import NDArray

from clients.datasets.folders import Sequence, find_sequences
from clients.robot import RobotClient
from clients.simulator.episode import Conduct, Episode, shuffled
from clients.simulator.pictures import fetch_pictures
from clients.simulator.replay import ReplaySubject
from clients.simulator.report import EpisodeRecord
from clients.simulator.summary import summarise
from core.backbones.base import Features, shown_patches
from service.app import create_app
from service.settings import Settings

SAMPLES = Path(__file__).parents[1] / "data" / "bursts"


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
def samples() -> list[Sequence]:
    """The sample sequences."""
    return find_sequences(SAMPLES)


@contextmanager
def serving(memory: Path) -> Iterator[str]:
    """The address of a service for which everything but an identical burst is novel."""
    app = create_app(Settings(data_dir=memory, score="pooled_best_view", threshold=0.9999), backbone=CentreBackbone())
    server = uvicorn.Server(uvicorn.Config(app, host="127.0.0.1", port=0, log_level="warning"))
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    while not server.started:
        time.sleep(0.01)
    yield f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
    server.should_exit = True
    thread.join()


@pytest.fixture
def url(tmp_path: Path) -> Iterator[str]:
    """The address of a service with an empty memory."""
    with serving(tmp_path / "memory") as address:
        yield address


@pytest.fixture
def robot(url: str) -> Iterator[RobotClient]:
    """A client of that service."""
    with RobotClient(url) as client:
        yield client


@pytest.fixture(scope="session")
def record(samples: list[Sequence], tmp_path_factory: pytest.TempPathFactory) -> EpisodeRecord:
    """An episode: one object twice from the same sides, which the backbone recognises, and another of its category, which it does not."""
    with serving(tmp_path_factory.mktemp("episode") / "memory") as address, RobotClient(address) as robot:
        subjects = shuffled([ReplaySubject(samples[index]) for index in (0, 0, 1)], seed=1)
        encounters = list(Episode(robot, subjects, Conduct(views=12, seed=1)))
        pictures = {index: fetch_pictures(robot, encounter) for index, encounter in enumerate(encounters)}
        settings = {"seed": 1, "views": 12}
        return EpisodeRecord(summarise(encounters, 9.0), encounters, pictures, robot.categories(), robot.info(), settings)
