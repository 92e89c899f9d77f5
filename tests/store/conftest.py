"""A memory in a temporary folder, and the smallest things to put into it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from core.boxes import OrientedBox
from core.crop import Window
from core.descriptors import PcaBasis
from core.encode import EncodedBurst, EncodedView
from core.reference import Reference
from core.scan import ScanRequest
from core.sim3 import Sim3
from core.views import Burst, Camera, View
from store.memory import Memory
from store.observations import Answer
from store.records import AuditEntry, Category

VIEWS, PATCHES, DIM = 3, 5, 8
NOVEL, KNOWN = (Answer(outcome, None, None, None, None, None, None, {}) for outcome in ("novel", "known"))
"""Answers of which nothing else is kept."""


def last(memory: Memory) -> AuditEntry:
    """What was changed last."""
    return memory.audit.latest(1)[0]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Where the memory is."""
    return tmp_path / "memory"


@pytest.fixture
def memory(folder: Path) -> Iterator[Memory]:
    """An empty memory."""
    with Memory.open(folder) as opened:
        yield opened


@pytest.fixture
def burst() -> Burst:
    """Three random views with depth, cameras and masks."""
    rng = np.random.default_rng(1)
    K = np.array([[50.0, 0, 20], [0, 50, 16], [0, 0, 1]])

    def view(index: int) -> View:
        pose = np.eye(4)
        pose[:3, 3] = rng.normal(size=3)
        mask = np.zeros((32, 40), dtype=bool)
        mask[8:20, 10 + index : 30] = True
        depth_m = rng.integers(0, 30_000, (32, 40)).astype(np.float32) * np.float32(0.0001)
        return View(rng.integers(0, 256, (32, 40, 3), dtype=np.uint8), depth_m, Camera(K, pose), mask)

    return Burst([view(index) for index in range(VIEWS)])


@pytest.fixture
def encoded(burst: Burst) -> EncodedBurst:
    """Random tokens for the burst."""
    rng = np.random.default_rng(2)

    def view(camera: Camera | None) -> EncodedView:
        return EncodedView(
            grid=4,
            window=Window(-2, 3, 28),
            cells=np.argwhere(np.ones((4, 4)))[:PATCHES].astype(np.int16),
            descriptors=rng.normal(size=(PATCHES, DIM)).astype(np.float32),
            points_m=rng.normal(size=(PATCHES, 3)).astype(np.float32),
            saliency=rng.random((4, 4), dtype=np.float32),
            cls=rng.normal(size=DIM).astype(np.float32),
            pooled=rng.normal(size=DIM).astype(np.float32),
            camera=camera,
        )

    return EncodedBurst(tuple(view(each.camera) for each in burst.views), "fingerprint-a")


@pytest.fixture
def reference(encoded: EncodedBurst) -> Reference:
    """A reference of the encoded burst."""
    basis = PcaBasis.fit(np.concatenate([view.descriptors for view in encoded.views]), 4)
    box = OrientedBox(np.eye(4), np.array([0.1, 0.2, 0.3]))
    return Reference(encoded.views, basis, encoded.cloud_m, box, np.zeros((0, 3, 3)), encoded.fingerprint)


@pytest.fixture
def category(memory: Memory, reference: Reference, burst: Burst, encoded: EncodedBurst) -> Category:
    """One category."""
    return memory.categories.create(reference, burst, encoded, name="cup")


@pytest.fixture
def other(memory: Memory, category: Category, reference: Reference, burst: Burst, encoded: EncodedBurst) -> Category:
    """A younger one."""
    return memory.categories.create(reference, burst, encoded, name="mug")


@pytest.fixture
def full(memory: Memory, category: Category, other: Category, burst: Burst, request_for_views: ScanRequest) -> Memory:
    """Two categories, an observation, and a scan with views."""
    memory.observations.create(NOVEL, burst, {"a": np.arange(3)})
    memory.scans.add(memory.scans.create(request_for_views).id, burst)
    return memory


@pytest.fixture
def request_for_views() -> ScanRequest:
    """Two viewpoints."""
    return ScanRequest(np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.0, 1.0]), 0.8, np.stack([np.eye(4)] * 2), 0.4)


@pytest.fixture
def learnt(memory: Memory, category: Category, other: Category) -> Memory:
    """Two categories, made with a backbone; the first has a goal."""
    memory.require_backbone("colour", "fingerprint-a")
    memory.goals.create(category.id, "shelf", Sim3.identity(), frame="map", anchor="base")
    return memory


@pytest.fixture
def second(tmp_path: Path) -> Iterator[Memory]:
    """Another robot's memory, of the same backbone."""
    with Memory.open(tmp_path / "second") as memory:
        memory.require_backbone("colour", "fingerprint-a")
        yield memory


@pytest.fixture
def archive(learnt: Memory, tmp_path: Path) -> Path:
    """Everything, exported."""
    return learnt.export(tmp_path / "all.zip").path
