"""What a burst shows is told honestly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core.encode import EncodedBurst
from core.grounds import Grounds, grounds
from core.view_consistency import consistent_only
from core.views import Burst, View

from .conftest import IMAGE, PaintedObject, before_the_object


def photographs(count: int) -> Burst:
    return Burst([View(np.random.default_rng(each).integers(0, 255, (IMAGE, IMAGE, 3), dtype=np.uint8)) for each in range(count)])


def grounds_of(encoded: EncodedBurst) -> Grounds:
    return grounds(photographs(len(encoded.views)), encoded, consistent_only(encoded))


def test_views_from_all_sides_are_no_weak_grounds(painted: PaintedObject) -> None:
    found = grounds_of(painted.encode(6))
    assert (found.views, found.shown, found.with_depth) == (6, 6, 6)
    assert found.spread_deg is not None
    assert found.spread_deg > 60
    assert found.weakness is None


def test_one_view_says_how_little_it_is(painted: PaintedObject) -> None:
    found = grounds_of(painted.encode(6).select([2]))
    assert found.spread_deg == pytest.approx(0, abs=1e-4)
    assert "one view" in str(found.weakness)


def test_views_from_one_side_say_so(painted: PaintedObject) -> None:
    view = painted.encode(6).views[2]
    found = grounds_of(EncodedBurst((view, view), "painted"))
    assert "within 0°" in str(found.weakness)


def test_what_the_other_views_do_not_see_is_told_of(painted: PaintedObject) -> None:
    encoded = painted.encode(6)
    views = list(encoded.views)
    views[2] = before_the_object(views[2], 0.7)
    found = grounds_of(replace(encoded, views=tuple(views)))
    kinds = [[fault.kind for fault in view] for view in found.faults]
    assert [view for view, told in enumerate(kinds) if "contradicted" in told] == [2]
    (fault,) = found.faults[2][-1:]
    assert "70%" in fault.detail
