"""A robot carries out a scan: unreachable viewpoints go back for other ones, poor views are taken again, and a failure says why."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from clients.answers.categories import Category
from clients.answers.scans import ScanRequest
from clients.errors import InvalidInputProblem, TooFewViewsProblem
from clients.robot import Scan
from clients.simulator.arm import UP, Arm, ArmConfig, Limits
from clients.simulator.scanning import MOST_AGAIN, REPLACEMENTS, ScanFailed, ScanReport, carry_out
from core.camera_poses import hemisphere
from core.views import View

from .test_arm import CENTER_M, EmptyWorld

LEARNT = Category("c", None, "", 10, 1, (0.1, 0.1, 0.1))


class FakeScan(Scan):
    """Asks from `radius_m` away, finds fault with the views that `faulty` names, and has `spare` other viewpoints."""

    def __init__(self, radius_m: float, faulty: Sequence[int] = (), spare: Sequence[np.ndarray] = ()) -> None:
        poses = hemisphere(CENTER_M, UP, radius_m, 10)
        nothing = np.zeros(10, dtype=bool)
        self.request = ScanRequest("s", CENTER_M, UP, radius_m, poses, 0.1, nothing, 0, (), 2)
        self.taken: list[View] = []
        self.excluded: list[list[int]] = []
        self._faulty, self._spare = faulty, list(spare)

    def add(self, view: View) -> tuple[str, ...]:
        self.taken.append(view)
        return ("its sharpness is 0.1",) if len(self.taken) - 1 in self._faulty else ()

    def exclude(self, viewpoints: Sequence[int]) -> None:
        self.excluded.append(list(viewpoints))
        if not self._spare:
            raise InvalidInputProblem("no viewpoint is left", status=422)
        for index in viewpoints:
            self.request.world_from_camera[index] = self._spare.pop()

    def complete(self, name: str | None = None) -> Category:
        if len(self.taken) < 2:
            raise TooFewViewsProblem(f"views: the scan has {len(self.taken)} of at least 2 views", status=422)
        return LEARNT


def test_viewpoints_far_beyond_reach_are_looked_at_from_closer() -> None:
    scan = FakeScan(radius_m=12.8)
    arm = Arm(EmptyWorld())
    assert carry_out(arm, scan) is LEARNT
    assert len(scan.taken) >= 6
    assert all(arm.cannot_reach(view.camera.world_from_camera) is None for view in scan.taken if view.camera)


def test_what_nothing_comes_near_to_is_given_back_for_other_viewpoints() -> None:
    narrow = ArmConfig(limits=Limits(reach_m=(0.28, 0.75)))
    reachable = [pose for pose in hemisphere(CENTER_M, UP, 0.6, 60) if Arm(EmptyWorld(), narrow).cannot_reach(pose) is None]
    arm, scan, report = Arm(EmptyWorld(), narrow), FakeScan(0.6, spare=reachable), ScanReport()
    before = [pose for pose in scan if arm.nearest(pose, CENTER_M) is None]
    assert before
    carry_out(arm, scan, report=report)
    assert len(scan.excluded) == 1
    assert len(report.out_of_reach) == len(before)
    assert all("reaches 0.75 m" in reason or "bend" in reason for reason in report.out_of_reach)


def test_a_poor_view_is_taken_again_from_beside_a_few_times_at_most() -> None:
    scan, report = FakeScan(0.58, faulty=[0]), ScanReport()
    carry_out(Arm(EmptyWorld()), scan, report=report)
    assert (report.again, report.faults) == (1, ["its sharpness is 0.1"])
    first, again = (view.camera.world_from_camera[:3, 3] for view in scan.taken[:2] if view.camera)
    assert 0.05 < np.linalg.norm(again - first) < 0.3
    always, report = FakeScan(0.58, faulty=range(40)), ScanReport()
    carry_out(Arm(EmptyWorld()), always, report=report)
    assert report.again == MOST_AGAIN


def test_a_scan_without_views_says_of_its_viewpoints_why() -> None:
    scan = FakeScan(0.58)
    with pytest.raises(ScanFailed, match=r"1 of at least 2 views; out of reach: .* from the shoulder, which reaches 0.10 m"):
        carry_out(Arm(EmptyWorld(), ArmConfig(limits=Limits(reach_m=(0.0, 0.1)))), scan)
    assert len(scan.excluded) <= REPLACEMENTS
