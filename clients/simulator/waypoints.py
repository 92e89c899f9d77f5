"""A robot looks at an object it knows from random waypoints, and asks at each for the pose of what it sees then.

Paper, "Robotic novel object pose rearrangement". Nothing is learnt from these views: they show how steady the pose is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from clients.errors import ServiceProblem
from clients.pose_error import PoseError
from clients.robot import Observation, RobotClient
from clients.simulator.arm import Arm
from core.camera_poses import waypoints
from core.scan import infer_up, standoff_m
from core.views import Burst


@dataclass(frozen=True)
class Waypoint:
    """One of them; plain, so that a file can hold it."""

    observation_id: str
    """Empty where the service saw no object, and kept nothing."""
    world_from_camera: list[list[float]]
    """Where the view was taken, 4×4."""
    target_from_reference: list[list[float]] | None
    """The pose of this one view, 4×4 with the scale in it; None where there is none."""
    error: PoseError | None
    """Of that pose; None where there is no pose, or no truth to compare it with."""
    failure: str | None
    """Why there is no pose."""

    @staticmethod
    def from_plain(fields: Mapping[str, Any]) -> Waypoint:
        """From what JSON holds."""
        return Waypoint(**{**fields, "error": PoseError(**fields["error"]) if fields["error"] else None})


@dataclass(frozen=True)
class Visit:
    """How the waypoints of one object went."""

    waypoints: tuple[Waypoint, ...] = ()
    out_of_reach: int = 0
    """Waypoints left out, since the arm does not get there."""


def visit_waypoints(
    robot: RobotClient, arm: Arm, seen: Observation, burst: Burst, count: int, seed: int, score: Callable[[Observation], PoseError | None]
) -> Visit:
    """Goes past `count` random waypoints about an object just recognised; where the pose is not known there is nothing to aim at, and none.

    Args:
        seen, burst: what the service said of the object, and the views that it said it of.
        score: the error of an answer's pose.
    """
    if seen.pose is None:
        return Visit()
    center_m = seen.pose.world_from_object[:3, 3]
    radius_m = standoff_m(float(np.linalg.norm(seen.pose.extent_m)), burst.cameras)
    wanted = waypoints(center_m, infer_up(burst.cameras)[0], radius_m, count, seed, arm.at)
    reachable = [pose for pose in wanted if arm.cannot_reach(pose) is None]
    visited = []
    for pose in reachable:
        view = arm.look(pose)
        assert view.camera is not None
        place = view.camera.world_from_camera.tolist()
        try:
            answer = robot.observe(Burst([view]), category_id=seen.category_id, learn=False)
        except ServiceProblem as problem:
            visited.append(Waypoint("", place, None, None, str(problem)))
            continue
        matrix = None if answer.pose is None else answer.pose.matrix.tolist()
        visited.append(Waypoint(answer.id, place, matrix, score(answer), answer.pose_error))
    return Visit(tuple(visited), len(wanted) - len(reachable))
