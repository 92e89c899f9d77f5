"""An episode in figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from clients.pose_error import NO_POSE, PoseError, accuracy, median
from clients.simulator.encounter import Encounter, Verdict

ACC_DEG = (30.0, 15.0, 7.5)
"""Rotation errors up to which a pose counts as right (paper, Acc30, Acc15 and Acc7.5)."""


@dataclass(frozen=True)
class Spread:
    """How steady the poses of single views from waypoints are; errors are those of rightly recognised objects with ground truth."""

    visited: int
    out_of_reach: int
    without_pose: int
    """Of those visited."""
    median_deg: float | None
    """Rotation error; None where no pose could be compared with the truth."""
    worst_deg: float | None
    median_translation: float | None
    """Over the object's diagonal."""
    worst_translation: float | None


@dataclass(frozen=True)
class Summary:
    """See module."""

    objects: int
    kinds: int
    """True categories met."""
    categories: int
    """Categories in the memory at the end."""
    met_again: int
    """Objects whose category was in the memory."""
    correct_known: int
    false_novel: int
    false_known: int
    undecided: int
    acc30: float | None
    """Percentage of rightly recognised objects with ground truth whose rotation is at most 30° off; one without a pose counts as wrong."""
    acc15: float | None
    acc7_5: float | None
    median_deg: float | None
    """Median rotation error of the poses of rightly recognised objects."""
    observe_ms: float
    """Median time to an answer."""
    scan_ms: float | None
    """Median time from a scan's first view to its category."""
    refused: int
    """Viewpoints that no robot could reach, nor any near them."""
    motion_s: float
    """Simulated time that arms moved, all together."""
    total_s: float
    """Of this run; not of an earlier one that it continues."""
    waypoints: Spread | None = None
    """None where no object was looked at from any."""
    disagreements: tuple[str, ...] = ()
    """Where the memory is not what the encounters made of it, in words."""

    @property
    def false_novel_rate(self) -> float | None:
        """Percent of the objects whose category was in the memory."""
        return 100 * self.false_novel / self.met_again if self.met_again else None

    @property
    def false_known_rate(self) -> float:
        """Percent of all objects."""
        return 100 * self.false_known / self.objects


def summarise(encounters: Sequence[Encounter], total_s: float) -> Summary:
    """The figures of an episode that met at least one object."""
    count = {verdict: sum(each.verdict is verdict for each in encounters) for verdict in Verdict}
    errors = [each.error for each in encounters if each.error is not None]
    scans = [each.scan_ms for each in encounters if each.scan_ms is not None]
    scored = scored_errors(encounters)
    acc = [accuracy(scored, limit) if scored else None for limit in ACC_DEG]
    return Summary(
        objects=len(encounters),
        kinds=len({each.category for each in encounters}),
        categories=sum(each.learnt is not None for each in encounters),
        met_again=sum(each.in_memory for each in encounters),
        correct_known=count[Verdict.RECOGNISED],
        false_novel=count[Verdict.FALSE_NOVEL],
        false_known=count[Verdict.FALSE_KNOWN],
        undecided=count[Verdict.UNDECIDED],
        acc30=acc[0],
        acc15=acc[1],
        acc7_5=acc[2],
        median_deg=median(errors, "rotation_deg") if errors else None,
        observe_ms=float(np.median([each.observe_ms for each in encounters])),
        scan_ms=float(np.median(scans)) if scans else None,
        refused=sum(each.refused for each in encounters),
        motion_s=sum(each.motion_s for each in encounters),
        total_s=total_s,
        waypoints=spread(encounters),
    )


def spread(encounters: Sequence[Encounter]) -> Spread | None:
    """Over the waypoints of all encounters; None where there were none."""
    visited = [waypoint for each in encounters for waypoint in each.waypoints]
    out_of_reach = sum(each.waypoints_out_of_reach for each in encounters)
    if not visited and not out_of_reach:
        return None
    errors = [each.error for each in visited if each.error is not None]
    return Spread(
        visited=len(visited),
        out_of_reach=out_of_reach,
        without_pose=sum(each.target_from_reference is None for each in visited),
        median_deg=median(errors, "rotation_deg") if errors else None,
        worst_deg=max(each.rotation_deg for each in errors) if errors else None,
        median_translation=median(errors, "translation") if errors else None,
        worst_translation=max(each.translation for each in errors) if errors else None,
    )


def scored_errors(encounters: Sequence[Encounter]) -> list[PoseError]:
    """Of every rightly recognised object with ground truth; the worst there is where it got no pose."""
    return [each.error or NO_POSE for each in encounters if each.verdict is Verdict.RECOGNISED and each.has_truth]
