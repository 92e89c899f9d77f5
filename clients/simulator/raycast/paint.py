"""Colours and patterns for surfaces: drawn by a seed, and functions of the place on the object.

Letters: V points.
"""

from __future__ import annotations

import colorsys
from collections.abc import Sequence

import numpy as np
from scipy.ndimage import map_coordinates

from clients.simulator.raycast.mesh import Colour, Paint
from core.views import FloatArray

Generator = np.random.Generator

WOODS: tuple[Colour, ...] = ((0.65, 0.45, 0.27), (0.45, 0.29, 0.17), (0.80, 0.64, 0.43), (0.32, 0.20, 0.13), (0.71, 0.52, 0.36))
METALS: tuple[Colour, ...] = ((0.72, 0.73, 0.75), (0.55, 0.56, 0.58), (0.78, 0.66, 0.36), (0.30, 0.31, 0.33))
LIGHTS: tuple[Colour, ...] = ((0.95, 0.94, 0.90), (0.93, 0.88, 0.76), (0.85, 0.88, 0.92), (0.96, 0.85, 0.82))
BLACK: Colour = (0.08, 0.08, 0.09)
WHITE: Colour = (0.94, 0.94, 0.93)
LATTICE = 17
"""Random values a side of the lattice that noise is interpolated from."""


def pick(rng: Generator, choices: Sequence[Colour]) -> Colour:
    """One of them, a little off."""
    chosen = np.array(choices[int(rng.integers(len(choices)))]) + rng.normal(scale=0.02, size=3)
    red, green, blue = np.clip(chosen, 0, 1)
    return float(red), float(green), float(blue)


def vivid(rng: Generator) -> Colour:
    """Any hue, well saturated."""
    return colorsys.hsv_to_rgb(float(rng.uniform()), float(rng.uniform(0.45, 0.9)), float(rng.uniform(0.4, 0.9)))


def pale(rng: Generator) -> Colour:
    """Any hue, hardly saturated."""
    return colorsys.hsv_to_rgb(float(rng.uniform()), float(rng.uniform(0.05, 0.3)), float(rng.uniform(0.75, 0.97)))


def muted(rng: Generator) -> Colour:
    """Any hue, as large things in rooms have it."""
    return colorsys.hsv_to_rgb(float(rng.uniform()), float(rng.uniform(0.15, 0.5)), float(rng.uniform(0.35, 0.8)))


def shade(colour: Colour, factor: float) -> Colour:
    """Darker below 1, lighter above."""
    red, green, blue = np.clip(np.array(colour) * factor, 0, 1)
    return float(red), float(green), float(blue)


def noise(points: FloatArray, period: float, seed: int) -> FloatArray:
    """Smooth random values of about −1 to 1 at points, shape (V, any), that change over `period`; shape (V,)."""
    lattice = np.random.default_rng(seed).uniform(-1, 1, (LATTICE,) * points.shape[1])
    return np.asarray(map_coordinates(lattice, (points / period).T, order=1, mode="grid-wrap"))


def mottled(colour: Colour, rng: Generator, period: float, strength: float = 0.08) -> Paint:
    """One colour that is lighter here and darker there, as nothing real is quite even."""
    seed = int(rng.integers(1 << 30))

    def paint(points: FloatArray) -> FloatArray:
        value = noise(points, period, seed) + 0.5 * noise(points, period / 3, seed + 1)
        return np.asarray(colour) * (1 + strength * value[:, None])

    return paint


def wood(colour: Colour, rng: Generator, period: float, axis: int = 2) -> Paint:
    """Grain along `axis`."""
    seed = int(rng.integers(1 << 30))

    def paint(points: FloatArray) -> FloatArray:
        stretched = points.copy()
        stretched[:, axis] *= 0.08
        rings = np.sin(2 * np.pi * (2.5 * noise(stretched, 3 * period, seed) + noise(stretched, period, seed + 1)))
        return np.asarray(colour) * (1 + 0.13 * rings[:, None])

    return paint


def bands(first: Colour, second: Colour, edges: Sequence[float], axis: int = 2) -> Paint:
    """Changes colour at every edge along `axis`."""

    def paint(points: FloatArray) -> FloatArray:
        odd = np.searchsorted(np.asarray(edges), points[:, axis]) % 2 == 1
        return np.where(odd[:, None], second, first)

    return paint


def dots(ground: Colour, spots: Colour, spacing: float, share: float = 0.32) -> Paint:
    """Spots around the z axis, `spacing` apart; `share` of it is their radius."""

    def paint(points: FloatArray) -> FloatArray:
        radius = float(np.median(np.linalg.norm(points[:, :2], axis=1)))
        around = max(3, round(2 * np.pi * radius / spacing))
        u = np.arctan2(points[:, 1], points[:, 0]) / (2 * np.pi) * around
        v = points[:, 2] / spacing
        u = u + 0.5 * (np.floor(v) % 2)
        off = np.hypot(u - np.floor(u) - 0.5, v - np.floor(v) - 0.5)
        return np.where((off < share)[:, None], spots, ground)

    return paint


def checks(first: Colour, second: Colour, spacing: float) -> Paint:
    """Squares of two colours in every plane across an axis."""

    def paint(points: FloatArray) -> FloatArray:
        odd = np.floor(points / spacing + 0.25).sum(axis=1) % 2 == 1
        return np.where(odd[:, None], second, first)

    return paint


def decorated(rng: Generator, low: float, high: float, ground: Colour | None = None) -> Paint:
    """Some pattern for a body that stands from z = `low` to `high`."""
    base = ground or (vivid(rng) if rng.uniform() < 0.6 else pick(rng, LIGHTS))
    other = vivid(rng) if rng.uniform() < 0.7 else pick(rng, LIGHTS)
    height = high - low
    kind = int(rng.integers(4))
    if kind == 0:
        return mottled(base, rng, height / 3, 0.05)
    if kind == 1:
        return dots(base, other, float(rng.uniform(0.14, 0.26)) * height)
    if kind == 2:
        middle, width = low + float(rng.uniform(0.35, 0.7)) * height, float(rng.uniform(0.08, 0.2)) * height
        return bands(base, other, [middle - width, middle + width])
    edges = np.sort(low + height * rng.uniform(0.1, 0.9, size=6))
    return bands(base, other, edges.tolist())
