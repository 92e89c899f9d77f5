"""Light that reaches a place: soft shadows of the lamps, and the room's glow where nothing is in its way.

It does not depend on where the camera is, so it is computed once for every placement. Letters: N places, D directions.
"""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from clients.simulator.raycast.room import Light, Room
from core.views import FloatArray

DIRECTIONS = 42
"""Of the glow."""
GLOW_REACH_M = 0.45
"""What is farther away than this does not shade: the room's walls throw back as much as they take."""
SHADED = 0.12
"""Share of the glow that reaches even a shaded place."""
LIFT_M = 1e-3
"""Rays start this far above a surface, lest it shade itself."""


def irradiance(scene: o3d.t.geometry.RaycastingScene, room: Room, points: FloatArray, normals: FloatArray) -> NDArray[np.float32]:
    """Linear red, green and blue light on places, shape (N, 3), of unit normals, shape (N, 3); what a white surface there sends back."""
    normals = normals.astype(np.float32)
    lifted = (points + LIFT_M * normals).astype(np.float32)
    total = _glow(scene, room, lifted, normals)
    for light in room.lights:
        total += _direct(scene, light, lifted, normals)
    return total


def _glow(
    scene: o3d.t.geometry.RaycastingScene, room: Room, points: NDArray[np.float32], normals: NDArray[np.float32]
) -> NDArray[np.float32]:
    height = 1 - 2 * (np.arange(DIRECTIONS) + 0.5) / DIRECTIONS
    angle = np.arange(DIRECTIONS) * np.pi * (3 - np.sqrt(5))
    level = np.sqrt(1 - height**2)
    directions = np.stack([level * np.cos(angle), level * np.sin(angle), height], axis=1).astype(np.float32)
    colours = np.where(height[:, None] > 0, room.sky, room.ground).astype(np.float32)
    total = np.zeros((len(points), 3), np.float32)
    for direction, colour in zip(directions, colours):
        cosine = normals @ direction
        facing = np.flatnonzero(cosine > 0)
        seen = ~_blocked(scene, points[facing], np.broadcast_to(direction, (len(facing), 3)), GLOW_REACH_M)
        share = cosine[facing] * (SHADED + (1 - SHADED) * seen) * np.float32(4 / DIRECTIONS)
        total[facing] += share[:, None] * colour
    return total


def _direct(
    scene: o3d.t.geometry.RaycastingScene, light: Light, points: NDArray[np.float32], normals: NDArray[np.float32]
) -> NDArray[np.float32]:
    total = np.zeros(len(points), np.float32)
    for place in light.points.astype(np.float32):
        towards = place - points
        squared = np.einsum("ni,ni->n", towards, towards)
        cosine = np.einsum("ni,ni->n", normals, towards) / np.sqrt(squared)
        facing = np.flatnonzero(cosine > 0)
        seen = ~_blocked(scene, points[facing], towards[facing], 1.0)
        total[facing] += cosine[facing] * seen / squared[facing]
    return np.asarray(total[:, None] * (light.power / len(light.points)).astype(np.float32))


def _blocked(
    scene: o3d.t.geometry.RaycastingScene, starts: NDArray[np.float32], directions: NDArray[np.float32], reach: float
) -> NDArray[np.bool_]:
    """Whether something is between a start and `reach` times the direction from it, shape (N,)."""
    rays = np.concatenate([starts, directions], axis=1)
    return np.asarray(scene.test_occlusions(o3d.core.Tensor.from_numpy(rays), tnear=0.0, tfar=reach).numpy())
