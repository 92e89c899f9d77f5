"""A small table world without faults, and a box of known size on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clients.simulator.raycast.mesh import Mesh
from clients.simulator.raycast.model import Model
from clients.simulator.raycast.sensor import IDEAL, SensorConfig
from clients.simulator.raycast.shapes import box

BOX_M = np.array([0.2, 0.12, 0.1])


@pytest.fixture(scope="session")
def small() -> SensorConfig:
    """A quarter of the pixels, no faults."""
    return replace(IDEAL, size=(120, 160), focal_px=145.0)


@pytest.fixture(scope="session")
def brick() -> Model:
    """0.2 × 0.12 × 0.1 m, red above and blue below."""
    mesh: Mesh = box(BOX_M).painted(lambda points: np.where(points[:, 2:] > 0, (0.8, 0.1, 0.1), (0.1, 0.1, 0.8)))
    return Model("brick", "brick_0", mesh.unit(), float(np.linalg.norm(BOX_M)))
