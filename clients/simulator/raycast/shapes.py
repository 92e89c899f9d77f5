"""Solids to build objects from: all of them are rows of closed curves, joined.

Letters: K rows, N points of a row. Vertices lie close together, since colour and light are kept at them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clients.simulator.raycast.mesh import Mesh
from core.views import FloatArray

SIDES = 96
CREASE_DEG = 35.0
"""A profile that turns more than this has an edge there, which must not be shaded as if it were round."""
STEPS = 64
"""Rows along the whole of a profile, about."""
CAP_RINGS = 10

Points = FloatArray | Sequence[Sequence[float]]


def loft(rows: FloatArray, *, closed_ends: bool = True) -> Mesh:
    """Joins closed curves, shape (K, N, 3), each of which runs counter-clockwise as seen from the next ones; the ends are closed flat."""
    if closed_ends:
        rows = np.concatenate([_cap(rows[0])[::-1], rows, _cap(rows[-1])])
    count, around = rows.shape[:2]
    index = np.arange(count * around).reshape(count, around)
    right = np.roll(index, -1, axis=1)
    quads = np.stack([index[:-1], right[:-1], right[1:], index[1:]], axis=-1).reshape(-1, 4)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return Mesh.plain(rows.reshape(-1, 3).astype(float), triangles)


def lathe(profile: Points, sides: int = SIDES) -> Mesh:
    """Turns (radius, z) points about z; going up the profile the outside is on the right hand."""
    curve = _finely(profile)
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    radius, height = curve[:, :1], curve[:, 1:]
    return loft(
        np.stack([radius * np.cos(angle), radius * np.sin(angle), np.broadcast_to(height, (len(curve), sides))], axis=-1), closed_ends=False
    )


def tube(path: Points, radius: float | Sequence[float] | FloatArray, *, flat: float = 1.0, sides: int = 24, smooth: bool = True) -> Mesh:
    """A bent rod along `path`, with one radius or one for every point; `flat` is its thickness over its width."""
    points = np.asarray(path, dtype=float)
    radii = np.broadcast_to(np.asarray(radius, dtype=float), len(points))
    if smooth and len(points) > 2:
        points, radii = spline(np.column_stack([points, radii]), STEPS)[:, :3], spline(np.column_stack([points, radii]), STEPS)[:, 3]
    else:
        share = np.linspace(0, len(points) - 1, STEPS // 2)
        points = np.stack([np.interp(share, np.arange(len(points)), points[:, axis]) for axis in range(3)], axis=1)
        radii = np.interp(share, np.arange(len(radii)), radii)
    ahead = np.gradient(points, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True).clip(1e-9)
    side = np.cross(ahead[0], np.eye(3)[np.abs(ahead[0]).argmin()])
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    rows = []
    for point, direction, thickness in zip(points, ahead, radii):
        side = side - direction * (side @ direction)
        side /= np.linalg.norm(side)
        other = np.cross(direction, side)
        rows.append(point + thickness * (np.outer(np.cos(angle), side) + flat * np.outer(np.sin(angle), other)))
    return loft(np.stack(rows))


def box(size: Sequence[float], radius: float = 0.0, detail: int = 24) -> Mesh:
    """A box about the origin, its edges rounded; `detail` vertices along its longest edge."""
    half = np.asarray(size, dtype=float) / 2
    radius = min(radius, float(half.min()) * 0.999)
    inner = half - radius
    places = [_edge(length, radius, max(2, round(detail * length / float(half.max())))) for length in half]
    faces = []
    for axis in range(3):
        first, second = (axis + 1) % 3, (axis + 2) % 3
        u, v = np.meshgrid(places[first], places[second], indexing="ij")
        for sign in (-1.0, 1.0):
            points = np.zeros((*u.shape, 3))
            points[..., first], points[..., second], points[..., axis] = u, v, sign * half[axis]
            core = np.clip(points, -inner, inner)
            outward = points - core
            length = np.linalg.norm(outward, axis=-1, keepdims=True)
            faces.append(_grid(core + outward * radius / np.maximum(length, 1e-12), flip=sign < 0))
    return Mesh.join(faces)


def sheet(width: float, height: float, detail: int) -> Mesh:
    """A rectangle about the origin across x, seen from the front: `width` along y, `height` along z, `detail` vertices along each."""
    y, z = np.meshgrid(np.linspace(-width / 2, width / 2, detail), np.linspace(-height / 2, height / 2, detail), indexing="ij")
    return _grid(np.stack([np.zeros_like(y), y, z], axis=-1), flip=False)


def ellipsoid(radii: Sequence[float], center: Sequence[float] = (0, 0, 0), sides: int = 64) -> Mesh:
    """About `center`."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, sides // 2)
    ball = lathe(np.stack([np.cos(angle).clip(0), np.sin(angle)], axis=1), sides)
    return ball.scaled(radii).moved(center)


def prism(outline: Points, height: float, bevel: float = 0.0) -> Mesh:
    """An outline in the xy plane, shape (N, 2), counter-clockwise, every point of which its middle sees, drawn up from z = 0."""
    flat = np.asarray(outline, dtype=float)
    ahead = np.roll(flat, -1, axis=0) - np.roll(flat, 1, axis=0)
    outward = np.stack([ahead[:, 1], -ahead[:, 0]], axis=1) / np.linalg.norm(ahead, axis=1, keepdims=True).clip(1e-12)
    quarter = np.linspace(0, np.pi / 2, 6)
    low = [(bevel * (1 - np.sin(angle)), bevel * (1 - np.cos(angle))) for angle in quarter]
    levels = [*low, *((inset, height - z) for inset, z in reversed(low))] if bevel else [(0.0, z) for z in np.linspace(0, height, 8)]
    rows = [np.column_stack([flat - inset * outward, np.full(len(flat), z)]) for inset, z in levels]
    return loft(np.stack(rows))


def spline(points: Points, count: int, *, closed: bool = False) -> FloatArray:
    """`count` points on a smooth curve through the given ones (Catmull–Rom), shape (count, any)."""
    given = np.asarray(points, dtype=float)
    padded = (
        np.concatenate([given[-1:], given, given[:2]])
        if closed
        else np.concatenate([2 * given[:1] - given[1:2], given, 2 * given[-1:] - given[-2:-1]])
    )
    spans = len(padded) - 3
    at = np.linspace(0, spans, count, endpoint=not closed)
    span = np.minimum(at.astype(int), spans - 1)
    t = (at - span)[:, None]
    a, b, c, d = (padded[span + offset] for offset in range(4))
    return np.asarray(0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3))


def rounded_rectangle(width: float, depth: float, radius: float, count: int = SIDES) -> FloatArray:
    """An outline about the origin, shape (count, 2), its points evenly spaced."""
    radius = min(radius, 0.499 * min(width, depth))
    angle = np.linspace(0, np.pi / 2, 12)
    corners = [(width / 2 - radius, depth / 2 - radius), (-width / 2 + radius, depth / 2 - radius)]
    corners += [(-x, -y) for x, y in corners]
    arcs = [
        np.stack([x + radius * np.cos(angle + quarter), y + radius * np.sin(angle + quarter)], axis=1)
        for (x, y), quarter in zip(corners, np.arange(4) * np.pi / 2)
    ]
    return evenly(np.concatenate(arcs), count)


def evenly(outline: FloatArray, count: int) -> FloatArray:
    """`count` points at equal distances along a closed outline, shape (count, 2)."""
    closed = np.concatenate([outline, outline[:1]])
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    at = np.linspace(0, along[-1], count, endpoint=False)
    return np.stack([np.interp(at, along, closed[:, axis]) for axis in range(2)], axis=1)


def _cap(row: FloatArray) -> FloatArray:
    """Rings from a row to its middle; the first repeats the row, so that the edge stays sharp."""
    shares = np.linspace(1, 0, CAP_RINGS)[:, None, None]
    middle = row.mean(axis=0)
    return np.asarray(middle + shares * (row - middle))


def _edge(half: float, radius: float, count: int) -> FloatArray:
    """Places along an edge from −half to half, closer to each other where it is rounded."""
    if radius == 0:
        return np.linspace(-half, half, count)
    turn = (half - radius) + radius * np.sin(np.linspace(0, np.pi / 2, 5))[1:]
    return np.concatenate([-turn[::-1], np.linspace(radius - half, half - radius, count), turn])


def _grid(points: FloatArray, *, flip: bool) -> Mesh:
    rows, columns = points.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1).reshape(-1, 4)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return Mesh.plain(points.reshape(-1, 3), triangles[:, ::-1] if flip else triangles)


def _finely(profile: Points) -> FloatArray:
    """The profile with points close together, and twice where it has an edge."""
    points = np.asarray(profile, dtype=float)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    counts = np.maximum(1, np.round(STEPS * lengths / max(lengths.sum(), 1e-12))).astype(int)
    heading = np.degrees(np.arctan2(*np.diff(points, axis=0).T))
    curve = [points[0]]
    for index, count in enumerate(counts):
        if index and abs((heading[index] - heading[index - 1] + 180) % 360 - 180) > CREASE_DEG:
            curve.append(points[index])
        curve += [points[index] + share * (points[index + 1] - points[index]) for share in np.arange(1, count + 1) / count]
    return np.stack(curve)
