"""Toys and a guitar: bear, duck, guitar."""

from __future__ import annotations

import numpy as np

from clients.simulator.raycast.mesh import Colour, Mesh, Paint
from clients.simulator.raycast.paint import BLACK, LIGHTS, METALS, WHITE, WOODS, Generator, mottled, pick, shade, vivid, wood
from clients.simulator.raycast.shapes import box, ellipsoid, evenly, lathe, loft, prism, spline, tube
from core.views import FloatArray

FURS: tuple[Colour, ...] = (
    (0.55, 0.36, 0.20),
    (0.72, 0.55, 0.35),
    (0.35, 0.23, 0.15),
    (0.86, 0.80, 0.70),
    (0.80, 0.55, 0.60),
    (0.50, 0.55, 0.65),
)


def bear(rng: Generator) -> list[Mesh]:
    """A teddy bear that sits and looks to the front."""
    fur = pick(rng, FURS)
    light = shade(fur, 1.35)
    coat = mottled(fur, rng, 0.03, 0.22)
    soft = mottled(light, rng, 0.03, 0.15)
    fat, head = float(rng.uniform(0.24, 0.3)), float(rng.uniform(0.2, 0.25))
    high = 0.52 + head * 0.75
    parts = [ellipsoid((fat * 0.9, fat, 0.31), (0, 0, 0.3)).painted(coat, 0.0)]
    parts.append(ellipsoid((fat * 0.55, fat * 0.72, 0.22), (fat * 0.42, 0, 0.29)).painted(soft, 0.0))
    parts.append(ellipsoid((head * 0.93, head, head * 0.92), (0.02, 0, high)).painted(coat, 0.0))
    snout = float(rng.uniform(0.42, 0.52)) * head
    parts.append(ellipsoid((snout, snout * 1.1, snout * 0.85), (head * 0.78, 0, high - head * 0.22)).painted(soft, 0.0))
    parts.append(
        ellipsoid((snout * 0.3, snout * 0.45, snout * 0.3), (head * 0.78 + snout * 0.85, 0, high - head * 0.06)).painted(BLACK, 0.7)
    )
    smile = [
        (head * 0.78 + snout * 0.9, y * snout, high - head * 0.3 - 0.12 * snout * (1 - (y / 0.45) ** 2))
        for y in np.linspace(-0.45, 0.45, 7)
    ]
    parts.append(tube(smile, 0.008).painted(BLACK))
    ear = float(rng.uniform(0.36, 0.5)) * head
    leg, arm = float(rng.uniform(0.1, 0.13)), float(rng.uniform(0.075, 0.1))
    for side in (-1, 1):
        parts.append(ellipsoid((ear * 0.5, ear, ear), (0.02, side * head * 0.75, high + head * 0.72)).painted(coat, 0.0))
        parts.append(
            ellipsoid((ear * 0.3, ear * 0.65, ear * 0.65), (0.02 + ear * 0.3, side * head * 0.75, high + head * 0.72)).painted(soft, 0.0)
        )
        parts.append(ellipsoid((0.03, 0.032, 0.036), (head * 0.83, side * head * 0.38, high + head * 0.22)).painted(BLACK, 0.9))
        thigh = [(0.05, side * fat * 0.75, 0.13), (0.25, side * fat * 0.95, 0.12), (0.42, side * fat * 1.0, 0.13)]
        parts.append(tube(thigh, [leg * 0.9, leg, leg]).painted(coat, 0.0))
        parts.append(ellipsoid((leg * 0.75, leg * 1.1, leg * 1.3), (0.42, side * fat * 1.02, 0.14)).painted(coat, 0.0))
        parts.append(ellipsoid((0.03, leg * 0.75, leg * 0.9), (0.42 + leg * 0.63, side * fat * 1.02, 0.14)).painted(soft, 0.0))
        upper = [(0.02, side * fat * 0.75, 0.52), (0.12, side * (fat + 0.1), 0.4), (0.24, side * (fat + 0.05), 0.3)]
        parts.append(tube(upper, [arm, arm, arm * 1.05]).painted(coat, 0.0))
        parts.append(ellipsoid((arm, arm, arm), (0.25, side * (fat + 0.045), 0.29)).painted(soft, 0.0))
    if rng.uniform() < 0.6:
        bow = vivid(rng)
        for side in (-1, 1):
            parts.append(ellipsoid((0.03, 0.09, 0.06), (fat * 0.85, side * 0.09, 0.53)).painted(bow, 0.3))
        parts.append(ellipsoid((0.035, 0.03, 0.03), (fat * 0.87, 0, 0.53)).painted(shade(bow, 0.7), 0.3))
    return parts


def duck(rng: Generator) -> list[Mesh]:
    """A bath duck, beak to the front."""
    body = (
        pick(rng, ((0.95, 0.80, 0.15), (0.96, 0.85, 0.30), (0.93, 0.93, 0.90), (0.55, 0.75, 0.85), (0.92, 0.60, 0.65)))
        if rng.uniform() < 0.8
        else vivid(rng)
    )
    beak = pick(rng, ((0.92, 0.45, 0.08), (0.85, 0.25, 0.10), (0.95, 0.60, 0.12)))
    wide = float(rng.uniform(0.3, 0.37))
    x = [-0.56, -0.5, -0.36, -0.1, 0.2, 0.38, 0.45]
    radius = np.array([0.03, 0.1, 0.24, 0.33, 0.31, 0.18, 0.02])
    rise = np.array([0.52, 0.46, 0.36, 0.30, 0.31, 0.33, 0.35]) + float(rng.uniform(-0.02, 0.04)) * np.array([2, 1.5, 0.5, 0, 0, 0, 0])
    curve = spline(np.column_stack([x, radius, rise]), 72)
    angle = np.linspace(0, 2 * np.pi, 96, endpoint=False)
    rows = []
    for at, r, z in curve:
        rows.append(np.column_stack([np.full(96, at), r * wide / 0.33 * np.cos(angle), np.maximum(z + r * 0.9 * np.sin(angle), 0.02)]))
    parts = [loft(np.stack(rows)).painted(mottled(body, rng, 0.4, 0.04), 0.5)]
    head = float(rng.uniform(0.2, 0.25))
    at = (0.24, 0.0, 0.56 + head * 0.75)
    parts.append(ellipsoid((head, head * 0.95, head * 0.98), at).painted(body, 0.5))
    parts.append(ellipsoid((head * 0.8, head * 0.75, head), (at[0] - 0.03, 0, at[2] - head * 0.75)).painted(body, 0.5))
    upper = [(at[0] + head * 0.75, 0, at[2] - 0.02), (at[0] + head * 1.2, 0, at[2] - 0.03), (at[0] + head * 1.62, 0, at[2] + 0.02)]
    parts.append(tube(upper, [0.1, 0.115, 0.05], flat=0.4).painted(beak, 0.4))
    lower = [(at[0] + head * 0.75, 0, at[2] - 0.07), (at[0] + head * 1.35, 0, at[2] - 0.085)]
    parts.append(tube(lower, [0.08, 0.06], flat=0.4).painted(shade(beak, 0.85), 0.4))
    for side in (-1, 1):
        eye = (at[0] + head * 0.72, side * head * 0.55, at[2] + head * 0.3)
        parts.append(ellipsoid((0.035, 0.03, 0.05), eye).painted(WHITE, 0.6))
        parts.append(ellipsoid((0.025, 0.025, 0.032), (eye[0] + 0.015, eye[1] + side * 0.013, eye[2])).painted(BLACK, 0.9))
        wing = ellipsoid((0.23, 0.06, 0.13)).turned("y", float(rng.uniform(8, 20))).moved((-0.1, side * (wide - 0.005), 0.36))
        parts.append(wing.painted(shade(body, 0.86), 0.5))
    if rng.uniform() < 0.3:
        hat = vivid(rng)
        parts.append(
            lathe([(0, 0), (0.2, 0), (0.2, 0.015), (0.12, 0.02), (0.11, 0.13), (0, 0.135)])
            .moved((at[0] - 0.02, 0, at[2] + head * 0.88))
            .painted(hat, 0.3)
        )
    return parts


def guitar(rng: Generator) -> list[Mesh]:
    """Lies on its back, head to the front."""
    lower, upper, waist = float(rng.uniform(0.2, 0.23)), float(rng.uniform(0.145, 0.17)), float(rng.uniform(0.11, 0.135))
    half = [
        (-0.5, 0.0),
        (-0.48, lower * 0.55),
        (-0.36, lower),
        (-0.2, lower * 0.85),
        (-0.1, waist),
        (0.0, upper * 0.97),
        (0.07, upper),
        (0.125, upper * 0.6),
        (0.14, 0.0),
    ]
    outline = evenly(spline([*((x, -y) for x, y in half), *((x, y) for x, y in half[::-1][1:-1])], 240, closed=True), 240)
    top = pick(rng, (*WOODS, (0.75, 0.35, 0.15), (0.60, 0.10, 0.08), (0.15, 0.25, 0.45)))
    side, depth = shade(pick(rng, WOODS), 0.7), float(rng.uniform(0.08, 0.11))
    parts = [prism(outline, depth, 0.006).painted(_board(top, side, depth, rng), 0.6)]
    hole = lathe([(0.058, depth), (0.058, depth + 0.002), (0, depth + 0.002)]).moved((-0.04, 0, 0))
    rosette = lathe([(0.075, depth), (0.075, depth + 0.0015), (0, depth + 0.0015)]).moved((-0.04, 0, 0))
    parts += [rosette.painted(shade(top, 0.5), 0.4), hole.painted((0.05, 0.04, 0.03))]
    parts.append(box((0.035, 0.16, 0.014), 0.004, 12).moved((-0.3, 0, depth + 0.006)).painted(shade(side, 0.5), 0.3))
    neck = 0.62
    parts.append(box((neck, 0.052, 0.03), 0.008, 24).moved((0.02 + neck / 2, 0, depth + 0.002)).painted(side, 0.4))
    parts.append(box((neck, 0.052, 0.008), 0.002, 24).moved((0.02 + neck / 2, 0, depth + 0.018)).painted(shade(side, 0.4), 0.4))
    for fret in range(14):
        x = 0.02 + neck - neck * (1 - 2 ** (-fret / 9))
        parts.append(box((0.004, 0.052, 0.004), detail=4).moved((x, 0, depth + 0.023)).painted(METALS[0], 0.7))
        if fret in (3, 5, 7, 9, 12):
            parts.append(ellipsoid((0.006, 0.006, 0.002), (x + 0.014, 0, depth + 0.022)).painted(LIGHTS[0]))
    head = box((0.15, 0.085, 0.022), 0.008, 16).moved((0.02 + neck + 0.07, 0, depth + 0.004))
    parts.append(head.painted(shade(side, 0.8), 0.5))
    for row in (-1, 1):
        for column in range(3):
            peg = (0.02 + neck + 0.03 + 0.04 * column, row * 0.058, depth + 0.008)
            parts.append(tube([(peg[0], row * 0.03, peg[2]), peg], 0.005).painted(METALS[0], 0.7))
            parts.append(ellipsoid((0.011, 0.008, 0.014), peg).painted(LIGHTS[1], 0.5))
    for string in np.linspace(-0.019, 0.019, 6):
        line = [(-0.3, string * 1.3, depth + 0.02), (0.02 + neck, string, depth + 0.027)]
        parts.append(tube(line, 0.0013, sides=6).painted(METALS[0], 0.8))
    if rng.uniform() < 0.5:
        guard = evenly(spline([(-0.12, -0.05), (-0.13, -0.12), (-0.05, -0.11), (0.03, -0.09), (-0.02, -0.075)], 60, closed=True), 60)
        parts.append(prism(guard, 0.003).moved((0, 0, depth)).painted(BLACK, 0.6))
    return parts


def _board(top: Colour, side: Colour, depth: float, rng: Generator) -> Paint:
    grain = wood(top, rng, 0.04, axis=0)
    assert callable(grain)

    def paint(points: FloatArray) -> FloatArray:
        edge = np.abs(points[:, 2] - depth) > 0.003
        return np.where(edge[:, None], side, grain(points))

    return paint
