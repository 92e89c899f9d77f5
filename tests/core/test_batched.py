"""Many similarities at once are what each is alone."""

from __future__ import annotations

import numpy as np
import torch

from core.estimators.batched import umeyama_batch
from core.sim3 import Sim3

from .conftest import same


def test_a_batch_of_fits_is_each_fit_alone(moved: Sim3) -> None:
    points = torch.from_numpy(np.random.default_rng(0).normal(size=(3, 5, 3)))
    aims = torch.from_numpy(np.stack([moved.apply(each.numpy()) for each in points]))
    aims[2] = points[2, :1]
    fitted, determined = umeyama_batch(points, aims)
    assert determined.tolist() == [True, True, False]
    assert same(fitted[0], moved)
    assert same(fitted[1], moved)
