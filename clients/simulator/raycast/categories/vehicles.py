"""Vehicles: car, aeroplane, locomotive, sailing boat."""

from __future__ import annotations

import numpy as np

from clients.simulator.raycast.mesh import Mesh, Paint
from clients.simulator.raycast.paint import BLACK, LIGHTS, METALS, WHITE, WOODS, Generator, bands, mottled, pick, shade, vivid, wood
from clients.simulator.raycast.shapes import box, ellipsoid, lathe, loft, prism, rounded_rectangle, spline, tube
from core.views import FloatArray

GLASS = (0.16, 0.21, 0.26)
TYRE = (0.09, 0.09, 0.10)


def wheel(radius: float, width: float, hub: tuple[float, float, float], y: float) -> Mesh:
    """On an axle along y, its face outwards on the side of `y`; about the origin but for `y`."""
    rubber = lathe(
        [
            (radius * 0.62, -width / 2),
            (radius * 0.93, -width / 2),
            (radius, -width * 0.3),
            (radius, width * 0.3),
            (radius * 0.93, width / 2),
            (radius * 0.62, width / 2),
        ],
        48,
    )
    disc = lathe(
        [(0, -width * 0.3), (radius * 0.63, -width * 0.42), (radius * 0.63, width * 0.3), (radius * 0.2, width * 0.42), (0, width * 0.5)],
        48,
    )
    spokes = [
        box((radius * 0.5, radius * 0.14, width * 0.3), detail=4).moved((radius * 0.36, 0, width * 0.28)).turned("z", 72 * k)
        for k in range(5)
    ]
    whole = Mesh.join([rubber.painted(TYRE), disc.painted(hub, 0.6), *(spoke.painted(shade(hub, 0.6), 0.4) for spoke in spokes)])
    return whole.turned("x", -90 if y > 0 else 90).moved((0, y, 0))


def car(rng: Generator) -> list[Mesh]:
    """A toy car, headlights to the front."""
    width = float(rng.uniform(0.4, 0.48))
    radius = float(rng.uniform(0.095, 0.125))
    waist, roof = float(rng.uniform(0.24, 0.29)), float(rng.uniform(0.4, 0.52))
    paint = vivid(rng) if rng.uniform() < 0.75 else pick(rng, (*METALS, WHITE, BLACK))
    hood, boot = float(rng.uniform(0.16, 0.3)), float(rng.uniform(-0.48, -0.3))
    floor = radius * 0.55
    nose, tail = waist * float(rng.uniform(0.78, 0.95)), waist * float(rng.uniform(0.9, 1.02))
    stations = [
        (-0.5, tail * 0.75, 0.8),
        (-0.485, tail * 0.96, 0.93),
        (-0.4, tail, 1.0),
        (boot, waist, 1.0),
        (hood, waist, 1.0),
        (0.4, nose, 0.98),
        (0.48, nose * 0.9, 0.92),
        (0.5, nose * 0.7, 0.8),
    ]
    body = _sections(stations, width, floor)
    parts = [body.painted(mottled(paint, rng, 0.3, 0.03), 0.8)]
    front, rear = hood - float(rng.uniform(0.08, 0.16)), boot + float(rng.uniform(0.0, 0.14))
    cabin = [
        (boot - 0.01, waist - 0.02, 0.9),
        (rear, roof, 0.78),
        ((front + rear) / 2, roof + 0.012, 0.78),
        (front, roof - 0.005, 0.77),
        (hood + 0.02, waist - 0.02, 0.88),
    ]
    parts.append(_sections(cabin, width, waist - 0.06, smooth=False).painted(_cabin(paint, waist, roof, rng), 0.8))
    hub = pick(rng, METALS[:3])
    axles = (0.31, -0.3)
    for x in axles:
        for side in (-1, 1):
            parts.append(wheel(radius, 0.085, hub, side * (width / 2 - 0.025)).moved((x, 0, radius)))
            arch = lathe([(radius * 1.16, -0.02), (radius * 1.16, 0.02), (0, 0.02)], 48).turned("x", -90 * side)
            parts.append(arch.moved((x, side * (width / 2 - 0.012), radius)).painted(BLACK))
    for side in (-1, 1):
        y = side * width * 0.33
        parts.append(ellipsoid((0.03, 0.055, 0.035), (0.487, y, nose * 0.72)).painted((0.98, 0.96, 0.80), 0.9))
        parts.append(box((0.03, 0.08, 0.045), 0.01, 6).moved((-0.49, y, tail * 0.75)).painted((0.75, 0.06, 0.06), 0.6))
        parts.append(box((0.05, 0.05, 0.035), 0.015, 6).moved((hood - 0.03, side * (width / 2 + 0.005), waist + 0.03)).painted(paint, 0.8))
        parts.append(box((0.05, 0.012, 0.014), 0.004, 4).moved((-0.02, side * width / 2, waist * 0.88)).painted(pick(rng, METALS), 0.8))
    parts.append(box((0.02, width * 0.45, 0.05), 0.01, 8).moved((0.496, 0, nose * 0.55)).painted(BLACK))
    for x in (0.49, -0.49):
        parts.append(box((0.05, width * 0.94, 0.045), 0.018, 12).moved((x, 0, floor + 0.04)).painted(shade(pick(rng, METALS), 0.7), 0.5))
    return parts


def aeroplane(rng: Generator) -> list[Mesh]:
    """A toy aeroplane, nose to the front."""
    radius, span = float(rng.uniform(0.055, 0.08)), float(rng.uniform(0.42, 0.52))
    jet = rng.uniform() < 0.6
    body, accent = (WHITE if rng.uniform() < 0.5 else vivid(rng)), vivid(rng)
    x = [-0.5, -0.46, -0.3, -0.1, 0.3, 0.42, 0.48, 0.5]
    r = np.array([0.12, 0.25, 0.65, 1.0, 1.0, 0.82, 0.42, 0.05]) * radius
    rise = [0.045, 0.04, 0.02, 0.0, 0.0, -0.008, -0.015, -0.018]
    curve = spline(np.column_stack([x, r, rise]), 72)
    angle = np.linspace(0, 2 * np.pi, 96, endpoint=False)
    rows = np.stack([np.stack([np.full(96, cx), cr * np.cos(angle), cz + cr * np.sin(angle)], axis=1) for cx, cr, cz in curve])
    parts = [loft(rows).painted(_fuselage(body, accent, radius), 0.6)]
    sweep, root = (float(rng.uniform(0.14, 0.22)), 0.2) if jet else (0.0, 0.17)
    tip = root * float(rng.uniform(0.35, 0.7))
    low = -0.4 * radius if jet else float(rng.choice([-0.6, 0.9])) * radius
    wing = _wing(root, tip, span, sweep, 0.05, 0.018).painted(_tipped(body, accent, span), 0.5)
    stabiliser = _wing(0.1, 0.055, 0.17, 0.07, 0.01, 0.01).painted(accent, 0.5)
    for each, at in ((wing, (0.1, 0.0, low)), (stabiliser, (-0.4, 0.0, 0.05))):
        parts += [each.moved(at), each.mirrored(1).moved(at)]
    parts.append(_wing(0.13, 0.07, 0.2, 0.11, 0.0, 0.012).turned("x", 90).painted(accent, 0.5).moved((-0.38, 0, 0.04)))
    if jet:
        for side in (-1, 1):
            nacelle = lathe(
                [(0.015, -0.09), (0.03, -0.06), (0.036, 0.02), (0.032, 0.05), (0.024, 0.05), (0.022, 0.03), (0, 0.03)], 48
            ).turned("y", 90)
            parts.append(nacelle.painted(bands(accent, pick(rng, METALS), [0.035], axis=0), 0.6).moved((0.13, side * 0.19, low - 0.045)))
    else:
        blades = [box((0.006, 0.03, 0.15), 0.003, 8).moved((0, 0, 0.08)).turned("x", 120 * k) for k in range(3)]
        parts += [blade.moved((0.507, 0, -0.018)).painted(BLACK) for blade in blades]
        parts.append(ellipsoid((0.03, 0.022, 0.022), (0.505, 0, -0.018)).painted(accent, 0.6))
    for place, y in ((0.36, 0.0), (0.02, 0.07), (0.02, -0.07)):
        ground = -radius - 0.075
        parts.append(tube([(place, y, -radius * 0.5), (place, y, ground + 0.02)], 0.008).painted(pick(rng, METALS)))
        parts.append(wheel(0.024, 0.02, METALS[0], 0.0).moved((place, y, ground + 0.024)))
    return parts


def locomotive(rng: Generator) -> list[Mesh]:
    """A steam engine, its chimney to the front."""
    main = pick(rng, ((0.70, 0.12, 0.10), (0.10, 0.35, 0.20), (0.12, 0.25, 0.55), (0.20, 0.20, 0.22), (0.85, 0.60, 0.12)))
    accent, metal = vivid(rng), pick(rng, METALS[:3])
    boiler, width = float(rng.uniform(0.12, 0.16)), 0.34
    deck = float(rng.uniform(0.17, 0.21))
    middle = deck + boiler + 0.01
    parts = [box((1.0, width, 0.05), 0.01).moved((0, 0, deck)).painted(shade(main, 0.55), 0.3)]
    drum = lathe([(0, -0.28), (boiler, -0.28), (boiler, 0.42), (boiler * 0.92, 0.45), (0, 0.46)]).turned("y", 90)
    rings = np.sort(np.concatenate([[at, at + 0.02] for at in (-0.1, 0.1, 0.3)])).tolist()
    parts.append(drum.painted(bands(main, metal, rings, axis=0), 0.6).moved((0, 0, middle)))
    parts.append(
        lathe([(0, 0), (boiler * 0.7, 0), (boiler * 0.6, 0.02), (0, 0.03)]).turned("y", 90).moved((0.45, 0, middle)).painted(BLACK, 0.4)
    )
    cab = float(rng.uniform(0.4, 0.5))
    parts.append(box((0.26, width, cab), 0.01, 32).moved((-0.36, 0, deck + cab / 2)).painted(main, 0.5))
    roof = prism(rounded_rectangle(0.36, width + 0.08, 0.03), 0.04, 0.015)
    parts.append(roof.moved((-0.36, 0, deck + cab)).painted(shade(accent, 0.8), 0.4))
    for side in (-1, 1):
        parts.append(box((0.13, 0.01, 0.13), 0.004, 8).moved((-0.36, side * width / 2, deck + cab * 0.68)).painted(GLASS, 0.8))
        for at in (-0.3, 0.0, 0.3):
            big = 0.13 if at < 0.2 else 0.09
            parts.append(wheel(big, 0.05, accent, side * (width / 2 - 0.01)).moved((at, 0, big)))
        parts.append(box((0.42, 0.02, 0.025), 0.006).moved((-0.14, side * (width / 2 + 0.03), 0.12)).painted(metal, 0.7))
        parts.append(tube([(0.5, side * 0.1, deck), (0.56, side * 0.1, deck)], 0.03).painted(metal, 0.6))
        parts.append(box((0.01, 0.09, 0.1), 0.003, 6).moved((-0.23, side * 0.1, deck + cab * 0.72)).painted(GLASS, 0.8))
    chimney = float(rng.uniform(0.2, 0.3))
    flare = float(rng.uniform(0.9, 1.8))
    funnel = lathe(
        [(0.05, 0), (0.045, chimney * 0.7), (0.045 * flare, chimney), (0.05 * flare, chimney + 0.02), (0.03, chimney + 0.02), (0, chimney)]
    )
    parts.append(funnel.moved((0.33, 0, middle + boiler * 0.9)).painted(BLACK if rng.uniform() < 0.6 else accent, 0.5))
    parts.append(ellipsoid((0.06, 0.06, 0.07), (0.08, 0, middle + boiler)).painted(pick(rng, METALS[2:3]), 0.8))
    parts.append(ellipsoid((0.03, 0.05, 0.05), (0.47, 0, middle + boiler * 1.05)).painted((0.98, 0.93, 0.7), 0.8))
    plough = loft(
        np.stack(
            [
                np.column_stack([np.full(4, at), [-y, y, y, -y], [0.02, 0.02, top, top]])
                for at, y, top in ((0.48, 0.17, 0.16), (0.6, 0.03, 0.06))
            ]
        )
    )
    parts.append(plough.painted(accent, 0.4))
    return parts


def sailboat(rng: Generator) -> list[Mesh]:
    """Bow to the front."""
    beam, height = float(rng.uniform(0.28, 0.38)), float(rng.uniform(0.16, 0.22))
    stations = np.linspace(-0.5, 0.5, 40)
    hull_colour, stripe, cloth = vivid(rng), WHITE, (pick(rng, LIGHTS) if rng.uniform() < 0.6 else vivid(rng))
    rows = []
    for x in stations:
        half = beam / 2 * np.sqrt(max(0.0, 1 - ((x + 0.12) / 0.63) ** 2)) if x > -0.12 else beam / 2 * (1 - 0.35 * ((x + 0.12) / 0.38) ** 2)
        sheer = height * (1 + 0.35 * max(0.0, x) + 0.1 * abs(x))
        keel = height * 0.55 * max(0.0, (x - 0.2) / 0.3) ** 2
        angle = np.linspace(np.pi, 2 * np.pi, 48)
        under = np.column_stack([np.full(48, x), half * np.cos(angle), keel + (sheer - keel) * (1 - np.abs(np.sin(angle)) ** 0.7)])
        deck = np.column_stack([np.full(24, x), np.linspace(half, -half, 26)[1:-1], np.full(24, sheer)])
        rows.append(np.concatenate([under, deck]))
    hull = loft(np.stack(rows)).painted(bands(shade(hull_colour, 0.5), hull_colour, [height * 0.35]), 0.5)
    deck_z = height * 1.0
    parts = [hull]
    outline = np.stack([np.array([row[0, 0], row[:, 1].max() * 0.9]) for row in rows[1:-1]])
    both = np.concatenate([np.column_stack([outline[:, 0], -outline[:, 1]]), outline[::-1]])
    parts.append(prism(both, 0.02).moved((0, 0, deck_z + 0.01)).painted(wood(pick(rng, WOODS), rng, 0.06, axis=0), 0.2))
    parts.append(box((0.24, beam * 0.5, 0.09), 0.02).moved((-0.12, 0, deck_z + 0.06)).painted(stripe, 0.3))
    for side in (-1, 1):
        for at in (-0.18, -0.06):
            parts.append(ellipsoid((0.025, 0.008, 0.02), (at, side * beam * 0.25, deck_z + 0.07)).painted(GLASS, 0.7))
    top = float(rng.uniform(1.0, 1.25))
    parts.append(tube([(0.06, 0, deck_z), (0.06, 0, top)], [0.017, 0.011]).painted(wood(pick(rng, WOODS), rng, 0.05)))
    parts.append(tube([(0.06, 0, deck_z + 0.16), (-0.46, 0, deck_z + 0.16)], 0.012).painted(pick(rng, WOODS)))
    parts.append(
        _sail((0.045, top - 0.04), (0.045, deck_z + 0.18), (-0.45, deck_z + 0.18), 0.05).painted(
            bands(cloth, vivid(rng), [float(rng.uniform(0.4, 0.6)), float(rng.uniform(0.62, 0.7))])
        )
    )
    jib = cloth if rng.uniform() < 0.5 else vivid(rng)
    parts.append(_sail((0.09, top - 0.15), (0.47, deck_z + 0.1), (0.1, deck_z + 0.12), 0.03).painted(jib))
    parts.append(box((0.08, 0.005, 0.05), 0.0, 4).moved((0.02, 0, top)).painted(vivid(rng)))
    return parts


def _sections(stations: list[tuple[float, float, float]], width: float, floor: float, *, smooth: bool = True) -> Mesh:
    """A body of rounded rectangles across x: (x, height of the top, share of the width)."""
    given = np.array(stations)
    if smooth:
        along = spline(given, 60)
    else:
        at = np.linspace(0, len(given) - 1, 80)
        along = np.stack([np.interp(at, np.arange(len(given)), given[:, column]) for column in range(3)], axis=1)
    rows = []
    for x, top, share in along:
        outline = rounded_rectangle(width * share, max(top - floor, 0.02), 0.05, 128)
        rows.append(np.column_stack([np.full(128, x), outline[:, 0], outline[:, 1] + (top + floor) / 2]))
    return loft(np.stack(rows))


def _cabin(paint: tuple[float, float, float], waist: float, roof: float, rng: Generator) -> Paint:
    """Glass between waist and roof, with pillars."""
    pillars = np.sort(rng.uniform(-0.2, 0.1, 1))
    top = shade(paint, 1.0) if rng.uniform() < 0.7 else shade(paint, 0.5)

    def colour(points: FloatArray) -> FloatArray:
        share = (points[:, 2] - waist) / (roof - waist)
        near_pillar = (np.abs(points[:, :1] - pillars) < 0.014).any(axis=1) & (np.abs(points[:, 1]) > 0.1)
        glass = (share > 0.06) & (share < 0.84) & ~near_pillar
        return np.where(glass[:, None], GLASS, top)

    return colour


def _fuselage(body: tuple[float, float, float], accent: tuple[float, float, float], radius: float) -> Paint:
    def colour(points: FloatArray) -> FloatArray:
        x, y, z = points.T
        result = np.broadcast_to(body, points.shape).copy()
        result[z < -0.3 * radius] = accent
        row = (np.abs(z - 0.25 * radius) < 0.17 * radius) & (np.abs(y) > 0.5 * radius) & (x > -0.32) & (x < 0.34)
        result[row & (np.abs((x / 0.045) % 1 - 0.5) < 0.28)] = GLASS
        result[(x > 0.385) & (x < 0.44) & (z > 0.25 * radius) & (z < 0.75 * radius)] = GLASS
        return result

    return colour


def _tipped(body: tuple[float, float, float], accent: tuple[float, float, float], span: float) -> Paint:
    def colour(points: FloatArray) -> FloatArray:
        return np.where((np.abs(points[:, 1]) > 0.82 * span)[:, None], accent, shade(body, 0.93))

    return colour


def _wing(root: float, tip: float, span: float, sweep: float, rise: float, thickness: float) -> Mesh:
    """From the origin along +y, its leading edge forward."""
    angle = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    rows = []
    for share in np.concatenate([np.linspace(0, 0.97, 40), [0.985, 1.0]]):
        chord = (root + (tip - root) * share) * (1.0 if share < 0.98 else 0.8)
        profile = np.sin(angle) * thickness * (1 - 0.5 * share) * (0.35 + 0.65 * (np.cos(angle) + 1) / 2)
        rows.append(np.column_stack([chord / 2 * np.cos(angle) - sweep * share, np.full(64, span * share), rise * share + profile]))
    return loft(np.stack(rows)[:, ::-1])


def _sail(head: tuple[float, float], tack: tuple[float, float], clew: tuple[float, float], belly: float) -> Mesh:
    """A triangle of cloth in the xz plane that bellies out along y."""
    steps = np.linspace(0, 1, 48)
    rows = []
    for share in np.linspace(0, 0.999, 48):
        first, last = np.array(tack) + share * (np.array(head) - tack), np.array(clew) + share * (np.array(head) - clew)
        line = first + steps[:, None] * (last - first)
        out = belly * np.sin(np.pi * steps) * np.sqrt(1 - share)
        front = np.column_stack([line[:, 0], out + 0.004, line[:, 1]])
        back = np.column_stack([line[:, 0], out - 0.004, line[:, 1]])[::-1]
        rows.append(np.concatenate([front, back]))
    return loft(np.stack(rows))
