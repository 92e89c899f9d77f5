"""What a burst shows is told honestly."""

from __future__ import annotations

import numpy as np
import pytest

from core.encode import EncodedBurst
from core.grounds import grounds
from core.sim3 import Sim3
from core.views import Burst, View

from .conftest import IMAGE, PaintedObject


def photographs(count: int) -> Burst:
    return Burst([View(np.random.default_rng(0).integers(0, 255, (IMAGE, IMAGE, 3), dtype=np.uint8))] * count)


def test_views_from_all_sides_are_no_weak_grounds(painted: PaintedObject) -> None:
    found = grounds(photographs(6), painted.encode(6, Sim3.identity()))
    assert (found.views, found.shown, found.with_depth) == (6, 6, 6)
    assert found.spread_deg is not None
    assert found.spread_deg > 60
    assert found.weakness is None


def test_one_view_says_how_little_it_is(painted: PaintedObject) -> None:
    found = grounds(photographs(1), painted.encode(6, Sim3.identity()).select([2]))
    assert found.spread_deg == pytest.approx(0, abs=1e-4)
    assert "one view" in str(found.weakness)


def test_views_from_one_side_say_so(painted: PaintedObject) -> None:
    view = painted.encode(6, Sim3.identity()).views[2]
    found = grounds(photographs(2), EncodedBurst((view, view), "painted"))
    assert "within 0°" in str(found.weakness)
