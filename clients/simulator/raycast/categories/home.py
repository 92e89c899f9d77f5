"""Things of a home: lamp, chair, clock, house, present."""

from __future__ import annotations

import numpy as np

from clients.simulator.raycast.mesh import Mesh, Paint
from clients.simulator.raycast.paint import (
    BLACK,
    LIGHTS,
    METALS,
    WHITE,
    WOODS,
    Generator,
    bands,
    checks,
    mottled,
    pale,
    pick,
    shade,
    vivid,
    wood,
)
from clients.simulator.raycast.shapes import box, ellipsoid, lathe, prism, spline, tube
from core.views import FloatArray


def lamp(rng: Generator) -> list[Mesh]:
    """A table lamp, alike from all sides."""
    foot, height = float(rng.uniform(0.2, 0.27)), float(rng.uniform(0.5, 0.75))
    belly = [float(value) for value in rng.uniform(0.04, 0.15, 4)]
    stem_colour = vivid(rng) if rng.uniform() < 0.5 else pick(rng, (*METALS, *WOODS))
    stem = spline([(0.06, 0.06), *((radius, 0.06 + height * (step + 1) / 5) for step, radius in enumerate(belly)), (0.03, height)], 48)
    wide, narrow, tall = float(rng.uniform(0.38, 0.48)), float(rng.uniform(0.2, 0.33)), float(rng.uniform(0.36, 0.5))
    cloth = pick(rng, LIGHTS) if rng.uniform() < 0.6 else pale(rng)
    low, high = height + 0.02, height + 0.02 + tall
    trim = shade(vivid(rng), 0.8)
    outside = lathe([(wide, low), (narrow, high)])
    inside = lathe([(narrow - 0.01, high), (wide - 0.01, low)])
    return [
        lathe([(0, 0), (foot, 0), (foot, 0.03), (foot * 0.85, 0.06), (0.06, 0.07), (0, 0.07)]).painted(shade(stem_colour, 0.85), 0.4),
        lathe([(0.06, 0.06), *stem]).painted(stem_colour, 0.5),
        outside.painted(bands(trim, cloth, [low + 0.035, high - 0.035]), 0.0),
        inside.painted((1.0, 0.96, 0.85), 0.0),
        ellipsoid((0.07, 0.07, 0.1), (0, 0, height + 0.13)).painted((1.0, 0.97, 0.85)),
        tube([(0, 0, height), (0, 0, high)], 0.015).painted(pick(rng, METALS), 0.5),
        tube([(-narrow, 0, high - 0.03), (narrow, 0, high - 0.03)], 0.008).painted(pick(rng, METALS), 0.5),
        lathe([(0, high - 0.04), (0.03, high - 0.03), (0.02, high + 0.02), (0, high + 0.04)]).painted(stem_colour, 0.5),
    ]


def chair(rng: Generator) -> list[Mesh]:
    """Its back is behind."""
    width, depth, seat = float(rng.uniform(0.42, 0.52)), float(rng.uniform(0.42, 0.5)), float(rng.uniform(0.42, 0.5))
    back, lean = float(rng.uniform(0.42, 0.62)), float(rng.uniform(0.02, 0.1))
    frame = wood(pick(rng, WOODS), rng, 0.12) if rng.uniform() < 0.7 else vivid(rng)
    leg = float(rng.uniform(0.018, 0.03))
    parts = []
    for x in (-1, 1):
        for y in (-1, 1):
            at = (x * (depth / 2 - 0.04), y * (width / 2 - 0.04))
            parts.append(tube([(at[0] * 1.08, at[1] * 1.08, 0), (*at, seat)], [leg * 0.8, leg]).painted(frame, 0.25))
    cushion = vivid(rng) if rng.uniform() < 0.6 else shade(pick(rng, WOODS), 0.9)
    parts.append(box((depth, width, 0.045), 0.015).moved((0, 0, seat)).painted(frame, 0.25))
    if rng.uniform() < 0.6:
        parts.append(box((depth * 0.9, width * 0.9, 0.05), 0.024).moved((0.005, 0, seat + 0.04)).painted(mottled(cushion, rng, 0.1), 0.0))
    top, rear = seat + back, -depth / 2 + 0.03
    for y in (-1, 1):
        post = [(rear, y * (width / 2 - 0.04), seat), (rear - lean, y * (width / 2 - 0.04), top)]
        parts.append(tube(post, leg).painted(frame, 0.25))
    style = int(rng.integers(3))
    if style == 0:
        panel = box((0.03, width - 0.06, back * 0.6), 0.012).moved((rear - 0.7 * lean, 0, seat + 0.66 * back))
        parts.append(panel.painted(mottled(cushion, rng, 0.1), 0.1))
    elif style == 1:
        for share in np.linspace(0.3, 0.95, int(rng.integers(3, 5))):
            slat = box((0.022, width - 0.06, 0.07), 0.01).moved((rear - share * lean, 0, seat + share * back))
            parts.append(slat.painted(frame, 0.25))
    else:
        for y in np.linspace(-0.3, 0.3, int(rng.integers(4, 6))) * width:
            parts.append(tube([(rear, y, seat), (rear - lean, y, top - 0.03)], 0.011).painted(frame, 0.25))
        parts.append(box((0.03, width - 0.02, 0.08), 0.014).moved((rear - lean, 0, top - 0.03)).painted(frame, 0.25))
    low = seat * float(rng.uniform(0.3, 0.5))
    for y in (-1, 1):
        rail = [(-depth / 2 + 0.04, y * (width / 2 - 0.035), low), (depth / 2 - 0.04, y * (width / 2 - 0.035), low)]
        parts.append(tube(rail, 0.012).painted(frame, 0.25))
    return parts


def clock(rng: Generator) -> list[Mesh]:
    """An alarm clock with two bells; its face is to the front."""
    radius, depth = 0.5, float(rng.uniform(0.3, 0.42))
    case, metal = vivid(rng), pick(rng, METALS[:3])
    face = WHITE if rng.uniform() < 0.7 else pale(rng)
    rim = lathe(
        [
            (0, -depth / 2),
            (radius * 0.94, -depth / 2),
            (radius, -depth / 2 + 0.05),
            (radius, depth / 2),
            (radius * 0.9, depth / 2 + 0.02),
            (radius * 0.88, depth / 2 - 0.03),
        ]
    )
    dial = lathe([(radius * 0.9, depth / 2 - 0.02), (0, depth / 2 - 0.019)])
    flat = [rim.painted(case, 0.6), dial.painted(face, 0.2)]
    for hour in range(12):
        size = (0.09, 0.03, 0.01) if hour % 3 == 0 else (0.05, 0.018, 0.01)
        flat.append(box(size, detail=4).moved((radius * 0.74, 0, depth / 2 - 0.014)).turned("z", 30 * hour).painted(BLACK))
    for length, thickness in ((0.24, 0.035), (0.34, 0.024)):
        hand = (
            box((length, thickness, 0.01), detail=6)
            .moved((length / 2 - 0.04, 0, depth / 2 - 0.006))
            .turned("z", float(rng.uniform(0, 360)))
        )
        flat.append(hand.painted(BLACK if rng.uniform() < 0.8 else (0.7, 0.1, 0.1)))
    flat.append(lathe([(0.035, depth / 2 - 0.01), (0.035, depth / 2 + 0.01), (0, depth / 2 + 0.01)]).painted(metal, 0.6))
    for x, y in ((0.2, 0.2), (-0.2, 0.2), (0.0, -0.22)):
        flat.append(tube([(x, y, -depth / 2), (x, y, -depth / 2 - 0.05)], 0.05).painted(metal, 0.6))
    parts = [part.turned("y", 90).turned("x", 90) for part in flat]
    for side in (-1, 1):
        bell = (
            lathe(spline([(0.0, 0.17), (0.14, 0.13), (0.2, 0.0)], 20)[::-1]).turned("x", -side * 35).moved((0, side * 0.31, radius * 0.87))
        )
        parts.append(bell.painted(metal, 0.8))
        parts.append(tube([(0, side * 0.2, -radius * 0.75), (0, side * 0.34, -radius * 1.12)], [0.05, 0.035]).painted(metal, 0.6))
    parts.append(tube([(0, 0, radius), (0, 0, radius * 1.2)], 0.02).painted(metal, 0.6))
    parts.append(ellipsoid((0.05, 0.06, 0.05), (0, 0, radius * 1.24)).painted(metal, 0.6))
    if rng.uniform() < 0.7:
        parts.append(tube([(0, -0.3, radius * 1.12), (0, 0, radius * 1.5), (0, 0.3, radius * 1.12)], 0.025).painted(metal, 0.6))
    return parts


def house(rng: Generator) -> list[Mesh]:
    """A toy house, its door to the front."""
    width, depth, wall = float(rng.uniform(0.8, 1.2)), float(rng.uniform(0.7, 0.9)), float(rng.uniform(0.45, 0.75))
    ridge, eave = float(rng.uniform(0.35, 0.6)), 0.09
    plaster = pick(rng, (*LIGHTS, (0.75, 0.42, 0.32), (0.85, 0.75, 0.5), (0.55, 0.68, 0.78)))
    tiles = pick(rng, ((0.60, 0.20, 0.14), (0.30, 0.30, 0.34), (0.45, 0.27, 0.18), (0.22, 0.38, 0.28)))
    trim, door, glass = WHITE, vivid(rng), (0.25, 0.36, 0.45)
    parts = [box((depth, width, wall)).moved((0, 0, wall / 2)).painted(mottled(plaster, rng, 0.15, 0.05))]
    gable = prism([(-depth / 2, 0), (depth / 2, 0), (0, ridge)], width).moved((0, 0, -width / 2)).turned("x", 90)
    parts.append(gable.moved((0, 0, wall)).painted(mottled(plaster, rng, 0.15, 0.05)))
    slope = float(np.hypot(depth / 2, ridge)) + eave
    pitch = float(np.degrees(np.arctan2(ridge, depth / 2)))
    for side in (-1, 1):
        slab = box((slope, width + 2 * eave, 0.04), 0.005, detail=64).moved((slope / 2, 0, 0.02)).painted(_tiles(tiles))
        parts.append((slab if side > 0 else slab.turned("z", 180)).turned("y", side * pitch).moved((0, 0, wall + ridge)))
    front = depth / 2
    parts.append(box((0.03, 0.2, 0.34), 0.005).moved((front, 0, 0.17)).painted(wood(door, rng, 0.05)))
    parts.append(ellipsoid((0.02, 0.014, 0.014), (front + 0.02, 0.06, 0.17)).painted((0.85, 0.7, 0.3), 0.6))
    parts.append(box((0.12, 0.3, 0.03)).moved((front + 0.05, 0, 0.012)).painted((0.5, 0.5, 0.5)))
    for y in (-0.3 * width, 0.3 * width):
        parts += [part.moved((front, y, wall * 0.58)) for part in _window(0.17, 0.2, glass, trim)]
    for y in (-0.22 * width, 0.22 * width):
        parts += [part.turned("z", 180).moved((-front, y, wall * 0.55)) for part in _window(0.2, 0.16, glass, trim)]
    for side in (-1, 1):
        parts += [part.turned("z", 90 * side).moved((0, side * width / 2, wall * 0.75)) for part in _window(0.15, 0.2, glass, trim)]
    side = 1 if rng.uniform() < 0.5 else -1
    parts.append(
        box((0.13, 0.15, 0.42))
        .moved((-depth * 0.2, side * width * 0.3, wall + ridge * 0.85))
        .painted(checks((0.55, 0.25, 0.2), (0.48, 0.2, 0.16), 0.06))
    )
    return parts


def present(rng: Generator) -> list[Mesh]:
    """A parcel with a ribbon and a bow: the same after every quarter turn."""
    side, height = 0.8, float(rng.uniform(0.5, 0.9))
    paper, ribbon = vivid(rng), pick(rng, ((0.85, 0.1, 0.12), (0.9, 0.75, 0.25), (0.92, 0.92, 0.9), (0.15, 0.35, 0.7), (0.1, 0.5, 0.25)))
    lid = float(rng.uniform(0.1, 0.2))
    parts = [box((side, side, height), 0.01, detail=48).moved((0, 0, height / 2)).painted(_spots(paper, shade(paper, 1.5), 0.11), 0.3)]
    parts.append(
        box((side + 0.05, side + 0.05, lid), 0.01, detail=48).moved((0, 0, height - lid / 2 + 0.01)).painted(shade(paper, 0.8), 0.3)
    )
    for turn in (0, 90):
        parts.append(
            box((side + 0.07, 0.12, height + 0.03), 0.004, detail=32)
            .moved((0, 0, height / 2 + 0.01))
            .turned("z", turn)
            .painted(ribbon, 0.5)
        )
    for turn in range(45, 405, 90):
        loop = [(0, 0, 0), (0.2, 0, 0.16), (0.33, 0, 0.13), (0.27, 0, 0.02), (0, 0, 0)]
        parts.append(tube(loop, 0.075, flat=0.2).turned("z", turn).moved((0, 0, height + 0.03)).painted(ribbon, 0.5))
        tail = [(0, 0, 0.03), (0.2, 0, 0.03), (0.36, 0, 0.005)]
        parts.append(tube(tail, 0.045, flat=0.2).turned("z", turn + 45).moved((0, 0, height + 0.02)).painted(shade(ribbon, 0.9), 0.5))
    parts.append(ellipsoid((0.085, 0.085, 0.07), (0, 0, height + 0.07)).painted(shade(ribbon, 0.85), 0.5))
    return parts


def _tiles(colour: tuple[float, float, float]) -> Paint:
    def paint(points: FloatArray) -> FloatArray:
        row = np.floor(points[:, 0] / 0.07)
        across = points[:, 1] / 0.09 + 0.5 * (row % 2)
        gap = np.minimum(points[:, 0] / 0.07 - row, across - np.floor(across))
        return np.asarray(colour) * np.where(gap < 0.14, 0.6, 1.0 + 0.1 * np.sin(7.3 * np.floor(across) + 3.1 * row))[:, None]

    return paint


def _spots(ground: tuple[float, float, float], spot: tuple[float, float, float], spacing: float) -> Paint:
    """Spots on all faces of a box, the same after a quarter turn."""

    def paint(points: FloatArray) -> FloatArray:
        cells = points / spacing
        off = np.sort(np.abs(cells - np.round(cells)), axis=1)
        return np.where((np.hypot(off[:, 0], off[:, 1]) < 0.22)[:, None], spot, ground)

    return paint


def _window(width: float, height: float, glass: tuple[float, float, float], frame: tuple[float, float, float]) -> list[Mesh]:
    bars = [(0.05, width + 0.03, 0.03, 0, height / 2), (0.05, width + 0.05, 0.03, 0, -height / 2), (0.04, width, 0.018, 0, 0)]
    uprights = [(0.045, 0.028, height, width / 2, 0), (0.045, 0.028, height, -width / 2, 0), (0.04, 0.018, height, 0, 0)]
    made = [box((x, y, z), detail=6).moved((0, at_y, at_z)).painted(frame) for x, y, z, at_y, at_z in (*bars, *uprights)]
    return [box((0.02, width, height), detail=8).painted(glass, 0.8), *made]
