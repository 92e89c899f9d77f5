"""A camera on an arm: what it cannot reach it looks at from as near as it can, and moving takes (simulated) time.

Frames: the arm stands in the world, whose z is up. Lengths are metres, times seconds of the simulation.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from clients.simulator.world import World
from core.camera_poses import angles_about_deg, look_at
from core.sim3 import rotation_angle_deg
from core.views import Burst, FloatArray, View

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Limits:
    """What an arm on the edge of the table can do."""

    shoulder_m: tuple[float, float, float] = (-0.62, 0.0, 0.33)
    """Where the arm reaches from, in the world."""
    reach_m: tuple[float, float] = (0.28, 0.95)
    """Nearest and farthest that the camera can be from there."""
    clearance_m: float = 0.08
    """The camera stays this far above the table, z = 0."""
    wrist_deg: float = 150.0
    """Largest angle between where the forearm points and where the camera looks."""


@dataclass(frozen=True)
class ArmConfig:
    """How an arm moves."""

    limits: Limits | None = Limits()
    """None for a camera that can be anywhere, as recordings want it."""
    speed_m_s: float = 0.4
    turn_deg_s: float = 70.0
    settle_s: float = 0.4
    """Before a picture is sharp."""
    grip_s: float = 2.5
    """To close or to open the gripper."""


AZIMUTHS_DEG = (0, 12, -12, 24, -24, 36, -36, 48, -48)
ELEVATIONS_DEG = (0, 10, 20, 30, 40)
CLOSER = 0.85
"""Where else to look from when a viewpoint is out of reach: around the object, higher, closer step by step."""
NEAREST_M = 0.4
"""Closer than this an object is cut off by the image's edge."""
BESIDE_DEG = ((0, 15), (15, 0), (-15, 0), (0, -15))
BACK = (1.2, 1.0)
"""Where to look from once more after a view that turned out badly: higher, beside, lower, and better from a little farther off."""
MOST_OFF_DEG = 50.0
"""A view from farther off than this is none of what was asked for."""
APART_DEG = 6.0
"""Two views from directions closer than this are one."""


class Arm:
    """Moves a camera about a world, and things in it."""

    def __init__(self, world: World, config: ArmConfig | None = None) -> None:
        self.world = world
        self.config = config or ArmConfig()
        self.clock_s = 0.0
        """Simulated time spent moving."""
        self.refused = 0
        """Viewpoints that were out of reach, and for which there was no other."""
        self.offsets_deg: list[float] = []
        """How far off each view was from what was asked: the angle between both directions about the object."""
        self._at: FloatArray | None = None

    @property
    def at(self) -> FloatArray | None:
        """Where the camera is, world_from_camera of shape (4, 4); None before the first look."""
        return self._at

    def cannot_reach(self, world_from_camera: FloatArray) -> str | None:
        """Why the camera cannot be at a pose, shape (4, 4); None where it can."""
        limits = self.config.limits
        if limits is None:
            return None
        place, ahead = world_from_camera[:3, 3], world_from_camera[:3, 2]
        forearm = place - np.array(limits.shoulder_m)
        distance = float(np.linalg.norm(forearm))
        if distance > limits.reach_m[1]:
            return f"{distance:.2f} m from the shoulder, which reaches {limits.reach_m[1]:.2f} m"
        if distance < limits.reach_m[0]:
            return f"{distance:.2f} m from the shoulder, which cannot fold below {limits.reach_m[0]:.2f} m"
        if place[2] < limits.clearance_m:
            return f"{place[2]:.2f} m above the table, of which {limits.clearance_m:.2f} m are kept clear"
        bend = float(np.degrees(np.arccos(np.clip(forearm @ ahead / distance, -1, 1))))
        if bend > limits.wrist_deg:
            return f"the wrist would bend by {bend:.0f}°, and bends by {limits.wrist_deg:.0f}°"
        return None

    def nearest(self, world_from_camera: FloatArray, center_m: FloatArray) -> FloatArray | None:
        """The pose asked for, or where it is out of reach the nearest one about the object that is not; None where there is none."""
        if self.cannot_reach(world_from_camera) is None:
            return world_from_camera
        others = [pose for pose in _others(world_from_camera, center_m) if self.cannot_reach(pose) is None]
        off = [round(_angle_deg(world_from_camera, pose, center_m), 2) for pose in others]  # of one direction the farthest is first
        return others[int(np.argmin(off))] if off and min(off) <= MOST_OFF_DEG else None

    def beside(self, world_from_camera: FloatArray, center_m: FloatArray) -> FloatArray | None:
        """A pose that can be reached, a little beside one and farther off, to look once more; None where there is none."""
        others = (_turned(world_from_camera, center_m, turn, rise, back) for back in BACK for turn, rise in BESIDE_DEG)
        return next((pose for pose in others if self.cannot_reach(pose) is None), None)

    def look(self, world_from_camera: FloatArray) -> View:
        """Goes to a pose that can be reached, and takes a picture."""
        self.clock_s += self._travel_s(world_from_camera) + self.config.settle_s
        self._at = world_from_camera
        return self.world.capture(world_from_camera)

    def look_around(self, viewpoints: Sequence[FloatArray], center_m: FloatArray) -> Iterator[View]:
        """A view from each viewpoint, or from near it, by the shorter way around; no two from one place."""
        waiting = list(viewpoints)
        taken: list[FloatArray] = []
        while waiting:
            wanted = waiting.pop(int(np.argmin([self._travel_s(pose) for pose in waiting])))
            pose = self.nearest(wanted, center_m)
            if pose is None or any(_angle_deg(pose, other, center_m) < APART_DEG for other in taken):
                self.refused += 1
                continue
            taken.append(pose)
            view = self.look(pose)
            assert view.camera is not None
            self.offsets_deg.append(_angle_deg(wanted, view.camera.world_from_camera, center_m))
            yield view

    def glance(self, count: int, seed: int) -> Burst:
        """Views of whatever is there, from where a robot looks before it is asked for anything."""
        return Burst(list(self.look_around(self.world.viewpoints(count, seed), self.world.center_m)))

    def carry(self, distance_m: float, angle_deg: float) -> None:
        """Takes the time of a pick, a way and a place."""
        way = max(distance_m / self.config.speed_m_s, angle_deg / self.config.turn_deg_s)
        self.clock_s += 2 * self.config.grip_s + way

    def _travel_s(self, pose: FloatArray) -> float:
        if self._at is None:
            return 0.0
        distance = float(np.linalg.norm(pose[:3, 3] - self._at[:3, 3]))
        angle = float(rotation_angle_deg(pose[:3, :3], self._at[:3, :3]))
        return max(distance / self.config.speed_m_s, angle / self.config.turn_deg_s)


FREE = replace(ArmConfig(), limits=None)
"""A camera that can be anywhere."""


def _others(world_from_camera: FloatArray, center_m: FloatArray) -> Iterator[FloatArray]:
    """Poses about the object that look at the same point from other sides."""
    radius = float(np.linalg.norm(world_from_camera[:3, 3] - center_m))
    steps = 1 + max(0, int(np.log(NEAREST_M / radius) / np.log(CLOSER)))
    for turn in AZIMUTHS_DEG:
        for rise in ELEVATIONS_DEG:
            for step in range(steps):
                yield _turned(world_from_camera, center_m, turn, rise, CLOSER**step)


def _turned(world_from_camera: FloatArray, center_m: FloatArray, turn_deg: float, rise_deg: float, farther: float) -> FloatArray:
    """The pose carried around the object, up, and to `farther` times its distance; aimed at the object."""
    offset = world_from_camera[:3, 3] - center_m
    radius = float(np.linalg.norm(offset))
    azimuth = np.arctan2(offset[1], offset[0]) + np.radians(turn_deg)
    elevation = min(np.arcsin(np.clip(offset[2] / radius, -1, 1)) + np.radians(rise_deg), np.radians(80))
    towards = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    return look_at(center_m + farther * radius * towards, center_m, UP)


def _angle_deg(first: FloatArray, second: FloatArray, center_m: FloatArray) -> float:
    """Between the directions from which two poses, each of shape (4, 4), look at a point."""
    return float(angles_about_deg(first[None, :3, 3], second[None, :3, 3], center_m)[0, 0])
