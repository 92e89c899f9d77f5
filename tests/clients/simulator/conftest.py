"""A small table world without faults, and a box of known size on it."""

from __future__ import annotations

import numpy as np
import pytest

from clients.simulator.raycast.mesh import Mesh
from clients.simulator.raycast.model import Model
from clients.simulator.raycast.sensor import SensorConfig
from clients.simulator.raycast.shapes import box

BOX_M = np.array([0.2, 0.12, 0.1])


@pytest.fixture(scope="session")
def small() -> SensorConfig:
    """A quarter of the pixels, and no faults but for what its second eye does not see."""
    return SensorConfig(
        size=(120, 160),
        focal_px=145.0,
        blur_px=0,
        noise=0,
        disparity_noise_px=0,
        disparity_step_px=0,
        speckle=0,
        edge_loss=0,
        grazing=0,
        hand_eye_deg=0,
        hand_eye_m=0,
        jitter_deg=0,
        jitter_m=0,
    )


@pytest.fixture(scope="session")
def brick() -> Model:
    """0.2 × 0.12 × 0.1 m, red above and blue below."""
    mesh: Mesh = box(BOX_M).painted(lambda points: np.where(points[:, 2:] > 0, (0.8, 0.1, 0.1), (0.1, 0.1, 0.8)))
    return Model("brick", "brick_0", mesh.unit(), float(np.linalg.norm(BOX_M)))
