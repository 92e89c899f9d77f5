"""One look at an object: what its views do not contradict, and how much that rests on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from core.encode import EncodedBurst
from core.look import Look, look
from core.views import Burst, View

from .conftest import IMAGE, PaintedObject, before_the_object


class Found:
    """Finds the same in every burst."""

    def __init__(self, found: EncodedBurst) -> None:
        self._found = found

    def encode(self, burst: Burst) -> EncodedBurst:
        """See `core.look.Encodes`."""
        return self._found


@pytest.fixture
def seen(painted: PaintedObject) -> Look:
    """Of six views, with a hand before most of the object in the third."""
    encoded = painted.encode(6)
    views = list(encoded.views)
    views[2] = before_the_object(views[2], 0.7)
    images = np.random.default_rng(0).integers(0, 255, (6, IMAGE, IMAGE, 3), dtype=np.uint8)
    return look(Burst([View(image) for image in images]), Found(replace(encoded, views=tuple(views))))


def test_what_follows_takes_only_what_the_views_agree_about(seen: Look) -> None:
    shares = [len(left.cells) / len(found.cells) for left, found in zip(seen.encoded.views, seen.found.views)]
    assert shares == [1, 1, pytest.approx(0.3, abs=0.01), 1, 1, 1]


def test_the_grounds_tell_of_what_was_contradicted(seen: Look) -> None:
    kinds = [[fault.kind for fault in view] for view in seen.grounds.faults]
    assert [view for view, told in enumerate(kinds) if "contradicted" in told] == [2]


def test_the_grounds_are_found_when_they_are_asked_for_and_once(seen: Look) -> None:
    assert "grounds" not in vars(seen)
    assert seen.grounds is seen.grounds
