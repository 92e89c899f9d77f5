"""The room around the objects: a table in the middle, floor and walls, each a rectangle with a picture on it.

World frame: the table's top is z = 0, its middle the origin; metres. Letters: Q rectangles; H, W texels of a picture.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from clients.simulator.raycast.mesh import Colour
from clients.simulator.raycast.paint import LIGHTS, WOODS, Generator, muted, noise, pale, pick, vivid
from core.views import FloatArray

TEXELS = 512
"""A side of every picture."""
TABLE_HEIGHT_M = 0.75
TABLE_THICKNESS_M = 0.04
ROOM_HALF_M = 2.6
CEILING_M = 1.9
"""Above the table."""
LIGHT_SAMPLES = 16
LIGHT_RADIUS_M = 0.45


@dataclass(frozen=True, eq=False)
class Quad:
    """A rectangle with a picture; its front is where `across` × `along` points."""

    corner: FloatArray
    """Where the picture's first texel is, shape (3,)."""
    across: FloatArray
    """Along the picture's rows, shape (3,)."""
    along: FloatArray
    """Along its columns, shape (3,)."""
    picture: FloatArray
    """sRGB, 0 to 1, shape (TEXELS, TEXELS, 3)."""

    @property
    def normal(self) -> FloatArray:
        """Unit vector, shape (3,)."""
        cross = np.cross(self.across, self.along)
        return np.asarray(cross / np.linalg.norm(cross))

    def points(self, count: int) -> FloatArray:
        """Places on it in a grid, row by row, shape (count², 3)."""
        share = (np.arange(count) + 0.5) / count
        return np.asarray(self.corner + share[:, None, None] * self.along + share[None, :, None] * self.across).reshape(-1, 3)


@dataclass(frozen=True, eq=False)
class Light:
    """A round lamp or window, bright enough to cast soft shadows."""

    points: FloatArray
    """Places on it, shape (LIGHT_SAMPLES, 3)."""
    power: FloatArray
    """Red, green and blue, linear, at 1 m and upright incidence, shape (3,)."""


@dataclass(frozen=True, eq=False)
class Room:
    """See module."""

    quads: tuple[Quad, ...]
    """The table's top first."""
    lights: tuple[Light, ...]
    sky: FloatArray
    """Linear light that comes from everywhere above, shape (3,)."""
    ground: FloatArray
    """The same from below, thrown back by table and floor, shape (3,)."""


def make_room(rng: Generator) -> Room:
    """Another room for every generator."""
    x, y, z, low = float(rng.uniform(0.55, 0.75)), float(rng.uniform(0.65, 0.95)), -TABLE_THICKNESS_M, -TABLE_HEIGHT_M
    top = _surface(rng, 2 * x, 2 * y)
    floor, wall_colour = _surface(rng, 2 * ROOM_HALF_M, 2 * ROOM_HALF_M), pick(rng, LIGHTS) if rng.uniform() < 0.6 else pale(rng)
    edge = np.broadcast_to(top.reshape(-1, 3).mean(axis=0) * 0.85, (TEXELS, TEXELS, 3)).astype(np.float32)
    quads = [_quad((-x, -y, 0), (2 * x, 0, 0), (0, 2 * y, 0), top)]
    for corner, across in (
        ((-x, -y, z), (2 * x, 0, 0)),
        ((x, y, z), (-2 * x, 0, 0)),
        ((x, -y, z), (0, 2 * y, 0)),
        ((-x, y, z), (0, -2 * y, 0)),
    ):
        quads.append(_quad(corner, across, (0, 0, TABLE_THICKNESS_M), edge))
    r = ROOM_HALF_M
    quads.append(_quad((-r, -r, low), (2 * r, 0, 0), (0, 2 * r, 0), floor))
    height = CEILING_M - low
    for corner, across in (
        ((-r, r, low), (2 * r, 0, 0)),
        ((r, -r, low), (-2 * r, 0, 0)),
        ((r, r, low), (0, -2 * r, 0)),
        ((-r, -r, low), (0, 2 * r, 0)),
    ):
        quads.append(_quad(corner, across, (0, 0, height), _wall(rng, wall_colour)))
    warm = float(rng.uniform(-0.12, 0.18))
    tint = np.array([1 + warm, 1.0, 1 - warm])
    lights = tuple(_light(rng, tint, share) for share in (1.0, float(rng.uniform(0.25, 0.6))))
    sky = np.array([0.97, 1.0, 1.05]) * float(rng.uniform(0.42, 0.6))
    mean = (top.reshape(-1, 3).mean(axis=0) ** 2.2 + floor.reshape(-1, 3).mean(axis=0) ** 2.2) / 2
    return Room(tuple(quads), lights, sky, 0.15 * sky + 0.5 * mean * sky)


def _quad(
    corner: tuple[float, float, float], across: tuple[float, float, float], along: tuple[float, float, float], picture: FloatArray
) -> Quad:
    return Quad(np.array(corner, dtype=float), np.array(across, dtype=float), np.array(along, dtype=float), picture)


def _light(rng: Generator, tint: FloatArray, share: float) -> Light:
    azimuth, distance = float(rng.uniform(0, 2 * np.pi)), float(rng.uniform(0.7, 1.5))
    middle = np.array([distance * np.cos(azimuth), distance * np.sin(azimuth), float(rng.uniform(1.2, 1.7))])
    radius = LIGHT_RADIUS_M * np.sqrt((np.arange(LIGHT_SAMPLES) + 0.5) / LIGHT_SAMPLES)
    angle = np.arange(LIGHT_SAMPLES) * np.pi * (3 - np.sqrt(5))
    first = np.cross(middle, [0, 0, 1.0])
    first /= np.linalg.norm(first)
    second = np.cross(middle, first) / np.linalg.norm(middle)
    disc = middle + radius[:, None] * (np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second)
    return Light(disc, tint * share * float(rng.uniform(1.6, 2.3)))


def _places(width_m: float, height_m: float) -> FloatArray:
    """Where each texel is, metres, shape (TEXELS, TEXELS, 2)."""
    share = (np.arange(TEXELS) + 0.5) / TEXELS
    return np.stack(np.meshgrid(share * width_m, share * height_m), axis=-1)


def _surface(rng: Generator, width_m: float, height_m: float) -> FloatArray:
    """Wood, tiles, stone, cloth or lino, sRGB, shape (TEXELS, TEXELS, 3)."""
    at = _places(width_m, height_m)
    seed = int(rng.integers(1 << 30))
    kind = int(rng.integers(5))
    u, v = at[..., 0], at[..., 1]
    flat = at.reshape(-1, 2)

    def rough(period: float, offset: int = 0, stretch: tuple[float, float] = (1.0, 1.0)) -> FloatArray:
        return noise(flat / np.array(stretch), period, seed + offset).reshape(u.shape)

    value: FloatArray
    base: Colour
    if kind == 0:
        base = pick(rng, WOODS)
        plank = np.floor(v / 0.11)
        grain = np.sin(2 * np.pi * (2.5 * rough(0.1, 0, (9, 1)) + 7 * v))
        value = 1 + 0.09 * grain + 0.05 * rough(0.012, 1, (12, 1)) + 0.09 * np.sin(plank * 12.9)
        value = np.where((v / 0.11) % 1 < 0.025, 0.55, value)
    elif kind == 1:
        base = pale(rng) if rng.uniform() < 0.6 else muted(rng)
        side = float(rng.uniform(0.12, 0.25))
        odd = (np.floor(u / side) + np.floor(v / side)) % 2
        joint = (np.minimum(u / side % 1, v / side % 1)) < 0.03
        value = np.where(joint, 0.6, 1 - float(rng.uniform(0.0, 0.35)) * odd + 0.05 * rough(0.06))
    elif kind == 2:
        base = pick(rng, (*LIGHTS, (0.45, 0.45, 0.47), (0.6, 0.52, 0.45)))
        veins = 1 - np.abs(rough(0.35) + 0.5 * rough(0.13, 1) + 0.25 * rough(0.05, 2))
        value = 0.93 + 0.08 * rough(0.02, 3) - 0.3 * np.clip(veins - 0.9, 0, 1) * 8
    elif kind == 3:
        base = muted(rng)
        weave = np.sin(2 * np.pi * u / 0.012) * np.sin(2 * np.pi * v / 0.012)
        stripe = (v / float(rng.uniform(0.08, 0.2))) % 1 < 0.2
        value = 0.95 + 0.06 * weave + 0.06 * rough(0.05) + 0.25 * stripe
    else:
        base = pale(rng)
        value = 0.95 + 0.05 * rough(0.2) + 0.12 * (rough(0.008, 1) > 0.6)
    return np.clip(np.asarray(base) * value[..., None], 0, 1).astype(np.float32)


def _wall(rng: Generator, colour: Colour) -> FloatArray:
    """Paint with a skirting board, and now and then a picture, a window or a shelf's shadow."""
    at = _places(2 * ROOM_HALF_M, CEILING_M + TABLE_HEIGHT_M)
    u, v = at[..., 0], at[..., 1]
    image = np.asarray(colour) * (0.97 + 0.03 * noise(at.reshape(-1, 2), 0.4, int(rng.integers(1 << 30))).reshape(u.shape))[..., None]
    image[v < 0.1] = (0.9, 0.9, 0.88)
    for _ in range(int(rng.integers(0, 3))):
        left, low = float(rng.uniform(0.3, 2 * ROOM_HALF_M - 1.3)), float(rng.uniform(0.8, 1.4))
        width, height = float(rng.uniform(0.5, 1.1)), float(rng.uniform(0.5, 0.9))
        inside = (u > left) & (u < left + width) & (v > low) & (v < low + height)
        frame = inside & ~((u > left + 0.05) & (u < left + width - 0.05) & (v > low + 0.05) & (v < low + height - 0.05))
        image[inside] = vivid(rng) if rng.uniform() < 0.6 else (0.82, 0.9, 0.98)
        image[frame] = pick(rng, WOODS)
    return np.asarray(cv2.GaussianBlur(np.clip(image, 0, 1).astype(np.float32), (0, 0), 0.8))
