"""Devices: laptop, camera, headphones."""

from __future__ import annotations

import numpy as np

from clients.simulator.raycast.mesh import Mesh, Paint
from clients.simulator.raycast.paint import BLACK, METALS, WHITE, Generator, mottled, noise, pick, shade, vivid
from clients.simulator.raycast.shapes import box, ellipsoid, lathe, sheet, spline, tube
from core.views import FloatArray

GLASS = (0.05, 0.06, 0.09)


def laptop(rng: Generator) -> list[Mesh]:
    """Open; who sits in front of it is at the front."""
    width, depth = 1.0, float(rng.uniform(0.64, 0.74))
    case = pick(rng, METALS) if rng.uniform() < 0.7 else vivid(rng)
    keys = BLACK if rng.uniform() < 0.7 else WHITE
    parts = [box((depth, width, 0.035), 0.012, 40).moved((0, 0, 0.018)).painted(case, 0.4)]
    top, pitch = 0.037, 0.062
    rows = 5
    parts.append(box((rows * pitch + 0.02, 14 * pitch + 0.02, 0.004), 0.002, 40).moved((-depth * 0.16, 0, top)).painted(shade(case, 0.6)))
    for row in range(rows):
        for column in range(14):
            if row == rows - 1 and 4 <= column <= 9:
                continue
            at = (-depth * 0.16 + (row - 2) * pitch, (column - 6.5) * pitch, top + 0.004)
            parts.append(box((pitch * 0.8, pitch * 0.8, 0.01), 0.003, 3).moved(at).painted(keys, 0.2))
    parts.append(box((pitch * 0.8, pitch * 5.8, 0.01), 0.003, 6).moved((-depth * 0.16 + 2 * pitch, 0, top + 0.004)).painted(keys, 0.2))
    parts.append(box((depth * 0.26, width * 0.3, 0.003), 0.001, 8).moved((depth * 0.31, 0, top)).painted(shade(case, 0.8), 0.4))
    tilt = float(rng.uniform(98, 122))
    tall = depth * 0.96
    lid = [box((0.022, width, tall), 0.01, 32).painted(case, 0.4)]
    lid.append(box((0.004, width * 0.97, tall * 0.95), 0.001, 8).moved((0.0105, 0, 0)).painted(BLACK, 0.3))
    lid.append(sheet(width * 0.9, tall * 0.82, 140).moved((0.0135, 0, 0.01)).painted(_picture(rng, width, tall), 0.6))
    lid.append(ellipsoid((0.004, 0.05, 0.05), (-0.011, 0, 0.02)).painted(shade(case, 1.35), 0.8))
    hinge = (-depth / 2 + 0.01, 0, 0.03)
    parts += [part.moved((0, 0, tall / 2)).turned("y", -(tilt - 90)).moved(hinge) for part in lid]
    return parts


def camera(rng: Generator) -> list[Mesh]:
    """A photographic camera, its lens to the front."""
    width, height, depth = 1.0, float(rng.uniform(0.55, 0.7)), float(rng.uniform(0.26, 0.34))
    top = pick(rng, METALS[:2]) if rng.uniform() < 0.5 else BLACK
    leather = BLACK if rng.uniform() < 0.6 else shade(vivid(rng), 0.6)
    band = height * 0.68
    parts = [box((depth, width, band), 0.05, 48).moved((0, 0, band / 2)).painted(mottled(leather, rng, 0.03, 0.2), 0.1)]
    parts.append(
        box((depth * 0.97, width * 0.98, height - band + 0.04), 0.03, 32).moved((0, 0, (height + band) / 2 - 0.02)).painted(top, 0.5)
    )
    parts.append(box((depth * 0.98, width * 0.99, 0.08), 0.03, 24).moved((0, 0, 0.03)).painted(top, 0.5))
    parts.append(box((depth * 0.95, 0.34, 0.2), 0.05, 24).moved((0.01, 0, height + 0.06)).painted(top, 0.4))
    parts.append(
        box((0.12, 0.16, band * 0.95), 0.055, 24).moved((depth / 2, -width * 0.4, band / 2)).painted(mottled(leather, rng, 0.03, 0.2), 0.1)
    )
    radius, reach = float(rng.uniform(0.22, 0.27)), float(rng.uniform(0.22, 0.5))
    barrel = [
        (radius, 0),
        (radius, 0.06),
        (radius * 0.93, 0.07),
        (radius * 0.93, reach * 0.5),
        (radius, reach * 0.52),
        (radius, reach * 0.85),
        (radius * 0.95, reach),
        (radius * 0.82, reach),
        (radius * 0.7, reach - 0.08),
        (0, reach - 0.09),
    ]
    lens = lathe(barrel, 128).painted(_barrel(radius, reach, top, rng), 0.4)
    glass = ellipsoid((radius * 0.68, radius * 0.68, 0.06), (0, 0, reach - 0.1)).painted((0.10, 0.08, 0.22), 1.0)
    for part in (lens, glass):
        parts.append(part.turned("y", 90).moved((depth / 2 - 0.01, 0.02, height * 0.42)))
    parts.append(lathe([(0.055, 0), (0.055, 0.05), (0, 0.055)]).moved((0.03, -width * 0.38, height)).painted(pick(rng, METALS), 0.7))
    for y, size in ((-width * 0.24, 0.07), (width * 0.34, 0.09)):
        dial = lathe([(size, 0), (size, 0.06), (size * 0.9, 0.07), (0, 0.07)]).moved((-0.02, y, height - 0.005))
        parts.append(dial.painted(shade(top, 0.8), 0.5))
    parts.append(box((0.02, 0.17, 0.08), 0.008, 8).moved((depth / 2 - 0.01, width * 0.34, height - 0.09)).painted((0.92, 0.93, 0.88), 0.9))
    parts.append(box((0.02, 0.13, 0.09), 0.004, 8).moved((-depth / 2, 0, height + 0.06)).painted(GLASS, 0.6))
    parts.append(box((0.012, width * 0.6, band * 0.75), 0.004, 16).moved((-depth / 2 - 0.002, 0.06, band * 0.52)).painted(GLASS, 0.8))
    for z in np.linspace(0.25, 0.75, 4) * band:
        parts.append(ellipsoid((0.012, 0.025, 0.025), (-depth / 2, -width * 0.38, z)).painted(METALS[1], 0.5))
    return parts


def headphones(rng: Generator) -> list[Mesh]:
    """Standing on the cups; the same after half a turn."""
    half, tall = float(rng.uniform(0.36, 0.42)), float(rng.uniform(0.75, 0.9))
    main, accent = (BLACK if rng.uniform() < 0.4 else vivid(rng)), vivid(rng)
    cushion = BLACK if rng.uniform() < 0.6 else shade(vivid(rng), 0.5)
    arc = spline(
        [
            (0, -half, 0.25),
            (0, -half * 1.02, 0.55),
            (0, -half * 0.6, tall * 0.97),
            (0, 0, tall * 1.06),
            (0, half * 0.6, tall * 0.97),
            (0, half * 1.02, 0.55),
            (0, half, 0.25),
        ],
        80,
    )
    parts = [tube(arc, 0.035, flat=0.45, smooth=False).painted(main, 0.4)]
    pad = arc[24:57] - np.array([0, 0, 0.018])
    parts.append(tube(pad, 0.062, flat=0.5, smooth=False).painted(cushion, 0.1))
    radius = float(rng.uniform(0.2, 0.25))
    for side in (-1, 1):
        shell = lathe(
            [(0, 0.13), (radius * 0.55, 0.125), (radius * 0.9, 0.09), (radius, 0.03), (radius, -0.02), (radius * 0.9, -0.04)][::-1]
        )
        ring = lathe([(radius * 0.6, 0.128), (radius * 0.6, 0.14), (radius * 0.45, 0.14), (0, 0.135)])
        soft = spline(
            [(radius * 0.55, -0.05), (radius * 0.6, -0.12), (radius * 0.8, -0.14), (radius * 0.98, -0.1), (radius * 0.95, -0.03)], 32
        )
        mesh = lathe([(0, -0.06), (radius * 0.6, -0.06)][::-1])
        cup = [shell.painted(main, 0.5), ring.painted(accent, 0.7), lathe(soft).painted(cushion, 0.1), mesh.painted(shade(accent, 0.4))]
        for part in cup:
            parts.append(part.turned("x", -90 * side).moved((0, side * half * 1.02, radius)))
        parts.append(box((0.09, 0.035, 0.2), 0.015, 12).moved((0, side * (half * 1.04), 0.42)).painted(accent, 0.6))
    return parts


def _picture(rng: Generator, width: float, height: float) -> Paint:
    """Something on a screen: a landscape and a window or two."""
    seed = int(rng.integers(1 << 30))
    sky, ground = np.array(vivid(rng)), np.array(vivid(rng))
    windows = [(float(rng.uniform(-0.3, 0.05)) * width, float(rng.uniform(-0.25, 0.05)) * height) for _ in range(int(rng.integers(1, 3)))]

    def paint(points: FloatArray) -> FloatArray:
        y, z = points[:, 1], points[:, 2]
        hills = 0.12 * height * noise(np.column_stack([y / 0.3, np.zeros(len(y))]), 1.0, seed)
        colours = np.where((z < hills)[:, None], ground, sky * (0.7 + 0.6 * (z / height + 0.4))[:, None])
        for left, low in windows:
            inside = (y > left) & (y < left + 0.32 * width) & (z > low) & (z < low + 0.3 * height)
            line = np.abs(((z - low) / (0.045 * height)) % 1 - 0.5) < 0.2
            colours[inside] = np.where(line[inside][:, None] & (y < left + 0.27 * width)[inside][:, None], 0.45, 0.96)
            colours[inside & (z > low + 0.26 * height)] = (0.3, 0.35, 0.5)
        return np.asarray(colours)

    return paint


def _barrel(radius: float, reach: float, trim: tuple[float, float, float], rng: Generator) -> Paint:
    """Grooves to grip, a coloured ring, letters around the glass."""
    ring = (0.75, 0.1, 0.1) if rng.uniform() < 0.5 else trim

    def paint(points: FloatArray) -> FloatArray:
        z = points[:, 2]
        angle = np.arctan2(points[:, 1], points[:, 0])
        outer = np.linalg.norm(points[:, :2], axis=1) > radius * 0.9
        colours = np.full(points.shape, 0.10)
        groove = outer & (z > reach * 0.55) & (z < reach * 0.83) & (np.sin(angle * 40) > 0)
        colours[groove] = 0.22
        colours[outer & (z > reach * 0.88) & (z < reach * 0.95)] = ring
        colours[outer & (z < 0.06)] = trim
        return colours

    return paint
