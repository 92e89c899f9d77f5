"""One look at an object: a burst as all that follows takes it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

from core.coherence import require_one_place, require_one_unit
from core.encode import EncodedBurst
from core.grounds import Grounds, grounds
from core.view_consistency import consistent_only
from core.views import Burst


class Encodes(Protocol):
    """Bursts in, tokens out."""

    def encode(self, burst: Burst) -> EncodedBurst:
        """See `core.encode.Encoder.encode`."""
        ...


@dataclass(frozen=True, eq=False)
class Look:
    """What a burst shows."""

    burst: Burst
    found: EncodedBurst
    """All that was found in its views."""
    encoded: EncodedBurst
    """Of that, what the views do not contradict of each other: what follows rests on this alone."""

    @cached_property
    def grounds(self) -> Grounds:
        """How much an answer about it rests on; found when an answer asks for it."""
        return grounds(self.burst, self.found, self.encoded)


def look(burst: Burst, encoder: Encodes) -> Look:
    """Raises NoObject where no view shows an object, InvalidInput where depth and cameras are in different units or cameras are wrong."""
    found = encoder.encode(burst)
    consistent = consistent_only(found)
    require_one_unit(consistent)
    require_one_place(found)  # by wrong cameras the views contradict each other, and what is left of them says little
    return Look(burst, found, consistent)
