"""Things of a kitchen: mug, teapot, bottle."""

from __future__ import annotations

import numpy as np

from clients.simulator.raycast.mesh import Mesh
from clients.simulator.raycast.paint import BLACK, LIGHTS, METALS, WHITE, Generator, bands, decorated, mottled, pick, shade, vivid
from clients.simulator.raycast.shapes import ellipsoid, lathe, spline, tube


def mug(rng: Generator) -> list[Mesh]:
    """A cup with a handle at the front."""
    height, top = 1.0, float(rng.uniform(0.38, 0.5))
    foot, belly = top * float(rng.uniform(0.75, 1.0)), top * float(rng.uniform(0.95, 1.12))
    wall, rim = 0.045, 0.02
    outside = spline([(foot, 0.04), (belly, 0.45), (top, height)], 24)
    inside = [(radius - wall, max(z, 0.08)) for radius, z in outside[::-1]]
    ground = vivid(rng) if rng.uniform() < 0.6 else pick(rng, LIGHTS)
    inner = WHITE if rng.uniform() < 0.6 else shade(ground, 1.1)
    shell = lathe([(0, 0.0), (foot * 0.85, 0.0), (foot, 0.04), *outside[1:]])
    parts = [shell.painted(decorated(rng, 0.0, height, ground), 0.5)]
    parts.append(lathe([(top, height), (top - wall / 2, height + rim), *inside, (0, 0.08)]).painted(inner, 0.5))
    if rng.uniform() < 0.5:
        level = height * float(rng.uniform(0.7, 0.88))
        parts.append(lathe([(0, 0.1), (0, level - 0.01), (top - wall * 0.9, level), (0, level + 0.001)]).painted((0.18, 0.10, 0.06), 0.6))
    reach, high, low = float(rng.uniform(0.26, 0.38)), height * float(rng.uniform(0.78, 0.9)), height * float(rng.uniform(0.15, 0.3))
    inset = top * 0.85
    path = [
        (inset, 0, high),
        (inset + 0.75 * reach, 0, high),
        (inset + reach + 0.05, 0, (high + low) / 2),
        (inset + 0.7 * reach, 0, low),
        (inset, 0, low),
    ]
    handle = shade(ground, 0.9) if rng.uniform() < 0.7 else vivid(rng)
    parts.append(tube(path, float(rng.uniform(0.055, 0.075)), flat=0.7).painted(handle, 0.5))
    return parts


def teapot(rng: Generator) -> list[Mesh]:
    """Spout to the front, handle behind."""
    width, height = float(rng.uniform(0.5, 0.62)), float(rng.uniform(0.7, 0.95))
    neck = width * float(rng.uniform(0.45, 0.62))
    ground = vivid(rng) if rng.uniform() < 0.5 else pick(rng, LIGHTS)
    accent = shade(ground, 0.6) if rng.uniform() < 0.6 else vivid(rng)
    profile = spline([(width * 0.62, 0.05), (width, 0.45 * height), (neck * 1.05, 0.95 * height), (neck, height)], 40)
    parts = [
        lathe([(0, 0), (width * 0.6, 0), (width * 0.62, 0.05), *profile[1:], (0, height)]).painted(decorated(rng, 0, height, ground), 0.6)
    ]
    lid = spline([(neck * 1.02, height), (neck * 0.8, height + 0.1), (0.12, height + 0.17)], 20)
    parts.append(lathe([(0, height - 0.02), (neck * 1.05, height), *lid, (0, height + 0.17)]).painted(shade(ground, 0.92), 0.6))
    parts.append(ellipsoid((0.085, 0.085, 0.075), (0, 0, height + 0.22)).painted(accent, 0.6))
    low, top = 0.32 * height, height * float(rng.uniform(0.95, 1.1))
    spout = [(width * 0.7, 0, low), (width * 1.25, 0, low + 0.12), (width * 1.45, 0, 0.72 * height), (width * 1.75, 0, top)]
    parts.append(tube(spout, [0.19, 0.14, 0.09, 0.065]).painted(shade(ground, 0.95), 0.6))
    parts.append(tube([spout[-1], (width * 1.77, 0, top + 0.012)], 0.05).painted(BLACK))
    reach = float(rng.uniform(0.4, 0.5))
    arc = [
        (-neck * 1.0, 0, height * 0.93),
        (-width - reach * 0.6, 0, height * 0.98),
        (-width - reach, 0, height * 0.6),
        (-width * 0.9, 0, height * 0.25),
    ]
    parts.append(tube(arc, [0.06, 0.07, 0.07, 0.055]).painted(accent, 0.6))
    parts.append(lathe([(0, 0), (width * 0.66, 0), (width * 0.66, 0.05), (0, 0.05)]).painted(accent, 0.5))
    return parts


def bottle(rng: Generator) -> list[Mesh]:
    """Alike from all sides: its label runs around it."""
    radius, shoulder = float(rng.uniform(0.2, 0.27)), float(rng.uniform(0.55, 0.8))
    neck, height = radius * float(rng.uniform(0.3, 0.42)), float(rng.uniform(1.15, 1.35))
    glass = [(0.10, 0.28, 0.14), (0.30, 0.17, 0.08), (0.55, 0.68, 0.66), (0.12, 0.20, 0.42), (0.45, 0.08, 0.10)][int(rng.integers(5))]
    slope = spline(
        [(radius, shoulder), (radius * 0.86, shoulder + 0.12), (neck * 1.1, shoulder + 0.3), (neck, shoulder + 0.42), (neck, height)], 40
    )
    body = lathe([(0, 0), (radius * 0.93, 0), (radius, 0.04), (radius, shoulder), *slope[1:], (0, height)])
    label, print_colour = pick(rng, LIGHTS), vivid(rng)
    low, high = shoulder * float(rng.uniform(0.12, 0.25)), shoulder * float(rng.uniform(0.75, 0.92))
    stripes = np.sort(rng.uniform(low, high, 2 * int(rng.integers(1, 4)))).tolist()
    band = lathe([(radius, low), (radius + 0.006, low), (radius + 0.006, high), (radius, high)])
    cap = pick(rng, METALS) if rng.uniform() < 0.4 else vivid(rng)
    thick = neck * 1.18
    top = lathe(
        [(neck, height - 0.06), (thick, height - 0.06), (thick, height + 0.05), (thick * 0.95, height + 0.065), (0, height + 0.065)]
    )
    collar = lathe([(neck, height - 0.1), (neck * 1.12, height - 0.095), (neck * 1.12, height - 0.075), (neck, height - 0.07)])
    return [
        body.painted(mottled(glass, rng, 0.4, 0.05), 0.9),
        band.painted(bands(label, print_colour, stripes), 0.1),
        top.painted(cap, 0.5),
        collar.painted(shade(glass, 0.9), 0.8),
    ]
