"""Where to look next when a burst may be of one category or another, or of none.

Laid on the burst at their best poses, the candidates' references predict what would be seen from every side. A viewpoint is worth most
where the predictions differ most and the burst has not looked yet.

Letters: n viewpoints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.backbones.whitening import Whitening
from core.camera_poses import angles_about_deg
from core.encode import EncodedBurst
from core.errors import InvalidInput
from core.evidence import Adaptation, match_views, part_tokens, whitened
from core.reference import Reference
from core.scan import ScanOptions, request_scan
from core.sim3 import Sim3
from core.views import FloatArray

OFFERED = 48
"""Viewpoints of the hemisphere that are compared."""
LOOKED_DEG = 30.0
"""A viewpoint this near one of the burst's, by angle about the object, shows little new."""
VIEWPOINTS = 3
"""So many are answered: the first may be out of the robot's reach."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A category that the burst may be of, laid on it."""

    reference: Reference
    target_from_reference: Sim3


def next_viewpoints(encoded: EncodedBurst, candidates: Sequence[Candidate], whitening: Whitening | None) -> FloatArray:
    """world_from_camera of up to VIEWPOINTS cameras in the burst's world, most telling first, shape (n, 4, 4).

    With one candidate nothing can differ, and what is unseen counts alone.

    Raises InvalidInput for views without cameras, NoObject where no depth places the object.
    """
    request = request_scan(encoded, ScanOptions(OFFERED))
    offered = request.world_from_camera[:, :3, 3]
    looked = np.stack([view.camera.world_from_camera[:3, 3] for view in encoded.views if view.camera is not None])
    unseen = 1 - np.exp(-((angles_about_deg(offered, looked, request.center_m).min(axis=1) / LOOKED_DEG) ** 2))
    worth = unseen * _difference(offered, request.center_m, candidates[:2], whitening)
    chosen: list[int] = []
    for index in np.argsort(-worth, kind="stable"):
        apart = angles_about_deg(offered[[index]], offered[chosen], request.center_m)
        if len(chosen) < VIEWPOINTS and (apart > LOOKED_DEG).all():
            chosen.append(int(index))
    return request.world_from_camera[chosen]


def _difference(places_m: FloatArray, center_m: FloatArray, candidates: Sequence[Candidate], whitening: Whitening | None) -> FloatArray:
    """How unlike the two candidates look from each place, shapes (n, 3) and (n,): one less the match of their nearest reference views."""
    if len(candidates) < 2:
        return np.ones(len(places_m))
    predicted = []
    for candidate in candidates:
        shown = [view for view in candidate.reference.views if len(view.cells)]
        if any(view.camera is None for view in shown):
            raise InvalidInput("reference", "has a view without camera: scan the category anew with K and world_from_camera")
        cameras = candidate.target_from_reference.apply(np.stack([view.camera.world_from_camera[:3, 3] for view in shown if view.camera]))
        parts = whitened(part_tokens(EncodedBurst(tuple(shown), candidate.reference.fingerprint)), whitening)
        units = Adaptation.none(parts.shape[-1]).directions(parts)
        predicted.append((angles_about_deg(places_m, cameras, center_m).argmin(axis=1), units))
    (first, of_first), (second, of_second) = predicted
    pairs = {pair: 1 - float(match_views(of_first[[pair[0]]], [of_second[[pair[1]]]])[0]) for pair in set(zip(first, second))}
    return np.array([pairs[pair] for pair in zip(first, second)])
