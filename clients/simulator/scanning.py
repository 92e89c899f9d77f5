"""A robot on an arm carries out a scan: what it cannot reach it has replaced, and after a poor view it looks again from beside."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from clients.answers.categories import Category
from clients.errors import ClientError, InvalidInputProblem, ServiceProblem, TooFewViewsProblem
from clients.robot import RobotClient, Scan
from clients.simulator.arm import Arm
from core.views import FloatArray

REPLACEMENTS = 4
"""How often viewpoints that nothing comes near to are given back for other ones."""
MOST_AGAIN = 3
"""Views taken once more: where all are poor, as of an object of another size than was thought, other viewpoints do not help."""


class ScanFailed(ClientError):
    """A scan that made no category; says why, viewpoint by viewpoint."""


COULD_NOT = (ServiceProblem, ScanFailed)
"""What costs a robot one object, and lets it go on to the next."""


@dataclass
class ScanReport:
    """How a scan went."""

    out_of_reach: list[str] = field(default_factory=list)
    """Of each viewpoint given back, why the arm does not get there."""
    faults: list[str] = field(default_factory=list)
    """What the service found wrong with views, those taken again included."""
    again: int = 0
    """Views taken because of that."""

    def __str__(self) -> str:
        """For people: each reason once, and how often it came."""
        said = []
        for what, reasons in (("out of reach", self.out_of_reach), ("wrong with views", self.faults)):
            if reasons:
                said.append(f"{what}: " + ", ".join(f"{reason} ({count}×)" for reason, count in Counter(reasons).most_common(3)))
        return "; ".join(said)


def carry_out(arm: Arm, scan: Scan, name: str | None = None, report: ScanReport | None = None) -> Category:
    """Brings a scan the views that it asks for, and completes it.

    Raises ScanFailed where they make no category, any other ServiceProblem as it is.
    """
    report = ScanReport() if report is None else report
    center_m = scan.request.center_m
    _replace_unreachable(arm, scan, center_m, report)
    for view in arm.look_around(list(scan), center_m):
        found = scan.add(view)
        assert view.camera is not None
        beside = arm.beside(view.camera.world_from_camera, center_m) if found and report.again < MOST_AGAIN else None
        report.faults.extend(found)
        if beside is not None:
            report.again += 1
            report.faults.extend(scan.add(arm.look(beside)))
    try:
        return scan.complete(name)
    except TooFewViewsProblem as problem:
        raise ScanFailed(f"{problem}; {report}" if str(report) else str(problem)) from problem


def _replace_unreachable(arm: Arm, scan: Scan, center_m: FloatArray, report: ScanReport) -> None:
    """Has other viewpoints asked for, for those that the arm does not come near to."""
    for _ in range(REPLACEMENTS):
        poses = list(scan)
        unreachable = [index for index, pose in enumerate(poses) if arm.nearest(pose, center_m) is None]
        if not unreachable:
            return
        report.out_of_reach.extend(arm.cannot_reach(poses[index]) or "nothing near it is in reach" for index in unreachable)
        try:
            scan.exclude(unreachable)
        except InvalidInputProblem:  # nothing is left to ask for: what can be had is brought
            return


def learn_from_scan(robot: RobotClient, arm: Arm, views: int, seed: int, name: str | None = None) -> Category:
    """A glance, a scan of what is there, and the category that it makes, whatever would be decided. Raises ServiceProblem, ScanFailed."""
    return carry_out(arm, robot.scan(arm.glance(views, seed)), name)
