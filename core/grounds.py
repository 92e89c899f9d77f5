"""How much the answer about a burst rests on: how many views, from how many sides, and what is wrong with them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.camera_poses import angles_about_deg
from core.coherence import incoherent
from core.encode import EncodedBurst
from core.quality import ViewFault, faults, region_of_encoded
from core.views import Burst

MOST_CONTRADICTED = 0.5
"""Share of what was found in a view that the other views may contradict before it is told."""
ONE_SIDE_DEG = 20.0
"""Views that differ by less, by angle about the object, show one side of it."""


@dataclass(frozen=True)
class Grounds:
    """What a burst shows of its object."""

    views: int
    shown: int
    """Views in which the object was found."""
    with_depth: int
    """Of these, how many have depth on it."""
    spread_deg: float | None
    """Largest angle about the object between two of them; None where cameras or depth are missing."""
    faults: tuple[tuple[ViewFault, ...], ...]
    """Of each view."""

    @property
    def weakness(self) -> str | None:
        """Why the answer rests on little, in one sentence; None where it does not."""
        if self.shown == 1:
            return "it rests on one view, which shows one side of the object: a few more from other sides would make it much surer"
        if self.spread_deg is not None and self.spread_deg < ONE_SIDE_DEG:
            return f"its views are within {self.spread_deg:.0f}° and show one side of the object: add some from other sides"
        return None


def grounds(burst: Burst, found: EncodedBurst, agreed: EncodedBurst) -> Grounds:
    """Of a burst, what was found in it, and what of that its views agree about (`core.view_consistency`)."""
    shown = [view for view in agreed.views if len(view.cells)]
    alone = (faults(view, region_of_encoded(seen)) for view, seen in zip(burst.views, found.views))
    told = tuple(own + beside for own, beside in zip(alone, incoherent(burst, found)))
    told = tuple(each or _contradicted(len(seen.cells), len(left.cells)) for each, seen, left in zip(told, found.views, agreed.views))
    return Grounds(len(burst), len(shown), sum(bool(view.trusted.any()) for view in shown), _spread_deg(agreed), told)


def _contradicted(found: int, left: int) -> tuple[ViewFault, ...]:
    if left >= MOST_CONTRADICTED * found:
        return ()
    return (
        ViewFault(
            "contradicted",
            f"the other views do not see {1 - left / found:.0%} of what stands out in it: something is before or beside the object",
        ),
    )


def _spread_deg(encoded: EncodedBurst) -> float | None:
    positions = [view.camera.world_from_camera[:3, 3] for view in encoded.views if view.camera is not None and len(view.cells)]
    if not positions or not len(encoded.cloud_m):
        return None
    places = np.stack(positions)
    return float(angles_about_deg(places, places, np.median(encoded.cloud_m, axis=0)).max())
